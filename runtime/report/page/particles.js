// The 3D view of particles. A page without WebGL keeps the picture that is there instead.

/** Turning, moving and zooming by mouse, fingers and keys; of two dimensions no turning. */
class OrbitControlsOf extends THREE.OrbitControls {
  constructor(camera, canvas) {
    super(camera, canvas);
    this.zoomSpeed = 1.5;
    canvas.addEventListener("keydown", (event) => this.keyPressed(event));
  }
  set flat(yes) {
    this.enableRotate = !yes;
    this.mouseButtons.LEFT = yes ? 2 : 0;  // THREE.MOUSE: pan, rotate
    this.touches.ONE = yes ? 1 : 0;        // THREE.TOUCH: pan, rotate
    this.isFlat = yes;
  }
  keyPressed(event) {
    const turn = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    const zoom = { "+": 0.88, "=": 0.88, "-": 1 / 0.88 }[event.key];
    if (!turn && !zoom) return;
    event.preventDefault();
    const camera = this.object, from = camera.position.clone().sub(this.target);
    if (zoom) from.multiplyScalar(zoom);
    if (turn && (event.shiftKey || this.isFlat)) {
      const along = new THREE.Vector3().setFromMatrixColumn(camera.matrix, 0).multiplyScalar(0.05 * from.length() * turn[0]);
      along.add(new THREE.Vector3().setFromMatrixColumn(camera.matrix, 1).multiplyScalar(-0.05 * from.length() * turn[1]));
      this.target.add(along);
    } else if (turn) {
      const length = from.length(), up = Math.acos(from.z / length) + 0.08 * turn[1], around = Math.atan2(from.y, from.x) + 0.08 * turn[0];
      const polar = Math.min(Math.PI - 0.01, Math.max(0.01, up));
      from.set(Math.sin(polar) * Math.cos(around), Math.sin(polar) * Math.sin(around), Math.cos(polar)).multiplyScalar(length);
    }
    camera.position.copy(this.target).add(from);
    this.update();
    this.dispatchEvent({ type: "change" });
  }
}

const vertexShader = `
  attribute float value;
  uniform float radius, height, signedRow;
  uniform sampler2D colours;
  varying vec3 colour;
  void main() {
    vec4 eye = modelViewMatrix * vec4(position, 1.0);
    gl_Position = projectionMatrix * eye;
    gl_PointSize = max(1.5, radius * height * projectionMatrix[1][1] / gl_Position.w);
    colour = value > 254.5 ? vec3(0.86, 0.08, 0.08)
                           : texture2D(colours, vec2((value + 0.5) / 255.0, signedRow)).rgb;
  }`;
const fragmentShader = `
  varying vec3 colour;
  void main() {
    vec2 at = 2.0 * gl_PointCoord - 1.0;
    float r = dot(at, at);
    if (r > 1.0) discard;
    float light = 0.72 + 0.28 * sqrt(1.0 - r) - 0.12 * (at.y + at.x) * 0.5;
    gl_FragColor = vec4(colour * light, 1.0);
  }`;

const bodyVertexShader = `
  varying vec3 place, eye;
  void main() {
    vec4 at = modelMatrix * vec4(position, 1.0), seen = viewMatrix * at;
    place = at.xyz;
    eye = seen.xyz;
    gl_Position = projectionMatrix * seen;
  }`;
// Particles that a body hides shine through. It ends a little outside of the box around particles.
const bodyFragmentShader = `
  uniform vec3 around;
  uniform float lit;
  varying vec3 place, eye;
  void main() {
    if (any(greaterThan(abs(place), around))) discard;
    vec3 normal = normalize(cross(dFdx(eye), dFdy(eye)));
    float light = mix(1.0, 0.5 + 0.5 * abs(dot(normal, normalize(vec3(-0.35, 0.6, 0.72)))), lit);
    gl_FragColor = vec4(vec3(0.69, 0.665, 0.625) * light, lit > 0.5 ? 0.72 : 1.0);
  }`;

/** Colours 0 to 254 of both maps, as rows of a texture. */
function paletteTexture(maps) {
  const data = new Uint8Array(maps.flatMap((map) => map.flatMap((hex) =>
    [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16)).concat(255))));
  const texture = new THREE.DataTexture(data, maps[0].length, maps.length);
  texture.needsUpdate = true;
  return texture;
}

/** The particles of one run in a canvas. */
class ParticleView {
  constructor(place, run, maps) {
    this.run = run;
    this.stage = place.querySelector(".stage");
    this.canvas = place.querySelector("canvas");
    this.now = place.querySelector(".now");
    this.renderer = new THREE.WebGLRenderer({ canvas: this.canvas, antialias: false, alpha: true, powerPreference: "high-performance" });
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(30, 1, 0.01, 1000);
    this.camera.up.set(0, 0, 1);
    this.size = run.high.map((high, d) => high - run.low[d]);
    this.largest = Math.max(...this.size) || 1;
    this.half = this.size.map((length) => length / this.largest / 2);
    this.makePoints(maps);
    this.makeBodies();
    this.makeBox();
    this.controls = new OrbitControlsOf(this.camera, this.canvas);
    this.controls.addEventListener("change", () => this.moved());
    this.listeners = [];
    this.frame = 0;
    this.field = 0;
    this.share = 0.3;  // of particles, while it moves, at first
    this.rough = false;  // drawn with fewer pixels, while it moves
    addEventListener("resize", () => this.draw());
    theme.listeners.push(() => this.draw());
  }
  makePoints(maps) {
    const share = this.run.shown / this.run.particles, dim = this.run.dim;
    // Fewer particles are drawn larger: they stand for their neighbours.
    const edge = this.run.edge / this.largest * Math.min(3, share ** (-1 / dim));
    this.radius = 0.62 * edge;
    this.material = new THREE.ShaderMaterial({
      vertexShader, fragmentShader,
      uniforms: { radius: { value: this.radius }, height: { value: 1 }, signedRow: { value: 0.25 },
                  colours: { value: paletteTexture(maps) } },
    });
    this.geometry = new THREE.BufferGeometry();
    this.points = new THREE.Points(this.geometry, this.material);
    this.points.frustumCulled = false;
    this.scene.add(this.points);
  }
  makeBodies() {
    const flat = this.run.dim === 2, around = 0.1;  // of the longest side, as in pictures
    this.bodyMaterial = new THREE.ShaderMaterial({
      vertexShader: bodyVertexShader, fragmentShader: bodyFragmentShader, transparent: !flat, side: 2,  // both
      uniforms: { around: { value: new THREE.Vector3(...this.half.map((half) => half + around)) },
                  lit: { value: flat ? 0 : 1 } },
    });
    this.withBodies = true;
    this.bodies = this.run.bodies.map((body) => {
      const shape = new THREE.BufferGeometry();
      shape.setAttribute("position", new THREE.BufferAttribute(new Float32Array(bytesOf(body.points).buffer), 3));
      shape.setIndex(new THREE.BufferAttribute(new Uint32Array(bytesOf(body.corners).buffer), 1));
      const shown = new (flat ? THREE.LineSegments : THREE.Mesh)(shape, this.bodyMaterial);
      shown.matrixAutoUpdate = false;
      shown.frustumCulled = false;
      this.scene.add(shown);
      return shown;
    });
  }
  placeBodies() {
    const s = 1 / this.largest;
    this.run.frames[this.frame].poses.forEach((rows, k) => {
      this.bodies[k].visible = this.withBodies && rows !== null;
      if (rows === null) return;
      this.bodies[k].matrix.set(...rows.map((value) => value * s), 0, 0, 0, 1);
      this.bodies[k].matrixWorldNeedsUpdate = true;
    });
  }
  showBodies(yes) {
    this.withBodies = yes;
    this.placeBodies();
    this.draw();
  }
  makeBox() {
    const corner = (k) => [0, 1, 2].map((d) => (k >> d & 1 ? 1 : -1) * this.half[d]);
    const ends = [];
    for (let k = 0; k < 8; ++k)
      for (let d = 0; d < 3; ++d)
        if (!(k >> d & 1) && (this.run.dim === 3 || d < 2)) ends.push(...corner(k), ...corner(k | 1 << d));
    const box = new THREE.BufferGeometry();
    box.setAttribute("position", new THREE.Float32BufferAttribute(ends, 3));
    this.boxMaterial = new THREE.LineBasicMaterial({ color: 0x888888, transparent: true, opacity: 0.55 });
    this.scene.add(new THREE.LineSegments(box, this.boxMaterial));
    this.axes = [0, 1, 2].slice(0, this.run.dim).map((d) => {
      const label = document.createElement("span");
      label.className = "axis-name";
      label.textContent = `${"xyz"[d]}  ${shortNumber(this.run.low[d], 3)} – ${shortNumber(this.run.high[d], 3)} m`;
      this.stage.append(label);
      return label;
    });
  }
  /** Decoded when it is shown first. */
  arrays(k) {
    const frame = this.run.frames[k];
    if (!frame.decoded) {
      const places = new Uint16Array(bytesOf(frame.places).buffer);
      const position = new Float32Array(places.length);
      for (let i = 0; i < places.length; ++i)
        position[i] = (places[i] / 65535 * 2 - 1) * this.half[i % 3];
      frame.decoded = { position: new THREE.BufferAttribute(position, 3), values: [] };
    }
    frame.decoded.values[this.field] ??= new THREE.BufferAttribute(bytesOf(frame.values[this.field]), 1);
    return frame.decoded;
  }
  show(frame, field, isSigned) {
    this.frame = Math.min(frame, this.run.frames.length - 1);
    this.field = field;
    const { position, values } = this.arrays(this.frame), at = this.run.frames[this.frame];
    this.geometry.setAttribute("position", position);
    this.geometry.setAttribute("value", values[field]);
    this.material.uniforms.signedRow.value = isSigned ? 0.75 : 0.25;
    this.placeBodies();
    this.now.textContent = `${at.stage ? at.stage + ", " : ""}t = ${shortNumber(at.time)} s`;
    this.draw();
  }
  look(direction) {
    const [x, y, z] = direction, distance = this.fit(direction);
    this.camera.position.set(x * distance, y * distance, z * distance);
    this.controls.target.set(0, 0, 0);
    this.controls.flat = this.run.dim === 2;
    this.controls.update();
    this.draw();
  }
  /** The distance from which all of the box is seen. */
  fit(direction) {
    const { clientWidth: w, clientHeight: h } = this.canvas, t = Math.tan(15 * Math.PI / 180);
    const norm = Math.hypot(...direction), n = direction.map((c) => c / norm);
    const up = Math.abs(n[2]) > 0.999 ? [0, 1, 0] : [0, 0, 1];
    const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let right = cross(up, n);
    right = right.map((c) => c / Math.hypot(...right));
    const above = cross(n, right);
    let distance = 0;
    for (let k = 0; k < 8; ++k) {
      const c = this.half.map((half, d) => (k >> d & 1 ? half : -half));
      const dot = (a) => a[0] * c[0] + a[1] * c[1] + a[2] * c[2];
      distance = Math.max(distance, dot(n) + Math.abs(dot(above)) / t, dot(n) + Math.abs(dot(right)) / (t * w / h));
    }
    return 1.04 * distance / norm;
  }
  moved() {
    for (const listener of this.listeners) listener(this);
    this.stir();
  }
  /** Draw something that moves: at a rate at which it looks smooth, and all of it when it rests. */
  stir() {
    this.moving = true;
    clearTimeout(this.rest);
    this.rest = setTimeout(() => {
      this.moving = false;
      this.draw();
    }, 200);
    this.draw();
  }
  /** What a frame took [ms] while the view moved says how many particles, and pixels, the next ones have. */
  adapt(took) {
    const least = 0.15;
    if (took > 30) {
      this.rough ||= this.share === least;
      this.share = Math.max(least, this.share * 0.85);
    } else if (took < 22) {
      this.share = Math.min(1, this.share * 1.05);
    }
  }
  follow(other) {
    this.camera.position.copy(other.camera.position);
    this.camera.quaternion.copy(other.camera.quaternion);
    this.controls.target.copy(other.controls.target);
    this.stir();
  }
  draw() {
    this.waiting ??= requestAnimationFrame(() => {
      this.waiting = undefined;
      this.render();
    });
  }
  render() {
    const begin = performance.now();
    const { clientWidth: w, clientHeight: h } = this.canvas;
    if (!w || !h) return;
    const ratio = Math.min(devicePixelRatio, this.moving && this.rough ? 1 : 2);
    if (this.canvas.width !== Math.floor(w * ratio) || this.canvas.height !== Math.floor(h * ratio)) {
      this.renderer.setPixelRatio(ratio);
      this.renderer.setSize(w, h, false);
      this.camera.aspect = w / h;
      this.camera.updateProjectionMatrix();
    }
    this.material.uniforms.height.value = h * ratio;
    this.boxMaterial.color.set(theme.dark ? 0xa3afbd : 0x56616f);
    // Any first part of the particles is spread over the body.
    const detail = this.moving ? this.share : 1, count = this.geometry.getAttribute("position").count;
    this.geometry.setDrawRange(0, Math.ceil(detail * count));
    this.material.uniforms.radius.value = this.radius * Math.min(1.5, detail ** (-1 / this.run.dim));
    this.camera.updateMatrixWorld();
    this.renderer.render(this.scene, this.camera);
    this.placeNames(w, h);
    // It took until the browser is ready for the next one.
    if (this.moving) requestAnimationFrame(() => this.adapt(performance.now() - begin));
  }
  placeNames(w, h) {
    // At the edge of the box that is lowest in the picture, of those along the axis.
    const at = new THREE.Vector3();
    this.axes.forEach((label, d) => {
      let best = null;
      for (let k = 0; k < 4; ++k) {
        const point = [0, 0, 0], others = [0, 1, 2].filter((e) => e !== d);
        others.forEach((e, i) => { point[e] = (k >> i & 1 ? 1 : -1) * this.half[e]; });
        at.set(...point).project(this.camera);
        const seen = { x: (at.x + 1) / 2 * w, y: (1 - at.y) / 2 * h };
        const better = d === 2 ? best && seen.x < best.x : best && seen.y > best.y;
        if (!best || better) best = seen;
      }
      const wide = label.offsetWidth / 2 + 4;
      label.style.left = `${Math.min(w - wide, Math.max(wide, best.x + (d === 2 ? -wide : 0)))}px`;
      label.style.top = `${Math.min(h - 10, Math.max(28, best.y + (d === 2 ? 0 : 14)))}px`;
    });
  }
}


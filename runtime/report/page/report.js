// The page is complete without this script, but for turning, playing and hints.

const looks = { "3d": [0.5, -0.72, 0.48], top: [0, -0.0001, 1], front: [0, -1, 0], side: [1, 0, 0] };

class Player {
  constructor(views, data) {
    this.views = views;
    this.data = data;
    this.frames = Math.max(...data.runs.map((run) => run.frames.length));
    this.slider = byId("frame");
    this.field = byId("field");
    this.slider.max = this.frames - 1;
    this.slider.value = this.frames - 1;
    this.slider.addEventListener("input", () => this.show());
    this.field.addEventListener("change", () => this.show());
    byId("play").addEventListener("click", () => this.toggle());
    for (const button of document.querySelectorAll("[data-look]"))
      button.addEventListener("click", () => this.look(button.dataset.look));
    for (const view of views) {
      view.listeners.push((one) => views.forEach((other) => other !== one && other.follow(one)));
      view.canvas.addEventListener("keydown", (event) => this.key(event));
    }
    byId("with-bodies").hidden = data.runs.every((run) => run.bodies.length === 0);
    byId("bodies").addEventListener("change", (event) => views.forEach((view) => view.showBodies(event.target.checked)));
    const flat = data.runs.every((run) => run.dim === 2);
    byId("looks").hidden = flat;
    this.home = flat ? "top" : "3d";
    this.look(this.home);
    this.show();
  }
  key(event) {
    const by = { ",": -1, ".": 1, PageUp: -1, PageDown: 1 }[event.key];
    if (by) this.step(by);
    else if (event.key === " ") this.toggle();
    else if (event.key === "Home") this.look(this.home);
    else return;
    event.preventDefault();
  }
  look(name) {
    this.views.forEach((view) => view.look(looks[name]));
  }
  step(by) {
    this.slider.value = (Number(this.slider.value) + by + this.frames) % this.frames;
    this.show();
  }
  toggle() {
    const button = byId("play");
    if (this.timer) clearInterval(this.timer);
    this.timer = this.timer ? null : setInterval(() => this.step(1), 120);
    button.textContent = this.timer ? "pause" : "play";
    button.setAttribute("aria-pressed", Boolean(this.timer));
  }
  show() {
    const k = Number(this.slider.value), field = Number(this.field.value), about = this.data.fields[field];
    // Of runs with fewer frames the one at the nearest time.
    const longest = this.data.runs.find((run) => run.frames.length === this.frames), time = longest.frames[k].time;
    this.views.forEach((view) => {
      const distance = view.run.frames.map((frame) => Math.abs(frame.time - time));
      const nearest = view.run === longest ? k : distance.indexOf(Math.min(...distance));
      view.show(nearest, field, about.signed);
    });
    byId("time").textContent = `t = ${shortNumber(time)} s, step ${longest.frames[k].step.toLocaleString("en-US")}`;
    const map = this.data.maps[about.signed ? 1 : 0];
    byId("scale-bar").style.background = `linear-gradient(to right, ${map.filter((_, i) => i % 6 === 0).concat(map.at(-1)).join(",")})`;
    byId("scale-low").textContent = shortNumber(about.low * about.factor);
    byId("scale-high").textContent = shortNumber(about.high * about.factor);
    byId("scale-unit").textContent = about.unit;
  }
}

function startParticles() {
  const data = JSON.parse(byId("particles-data").textContent), places = [...document.querySelectorAll(".view")];
  if (!data.runs.length) return;
  for (const [k, field] of data.fields.entries()) byId("field").append(new Option(field.label, k));
  try {
    // Shown before it is drawn: a canvas that is not laid out has no size.
    places.forEach((place) => place.classList.add("live"));
    for (const place of places) place.querySelector(".stage").hidden = false;
    const views = places.map((place, k) => new ParticleView(place, data.runs[k], data.maps));
    byId("player").hidden = byId("scale").hidden = false;
    globalThis.player = new Player(views, data);
  } catch (error) {
    for (const place of places) {
      place.classList.remove("live");
      place.querySelector(".stage").hidden = true;
    }
    const note = document.querySelector("#no-3d");
    note.hidden = false;
    note.textContent = `This browser shows no 3D view (${error.message}); the picture is the last frame.`;
  }
}

themeButton();
for (const figure of document.querySelectorAll("figure.chart[data-scale]")) new ChartHints(figure);
if (byId("player")) startParticles();
document.documentElement.dataset.ready = "yes";

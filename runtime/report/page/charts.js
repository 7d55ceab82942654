// Charts are there without this script; it tells values under the pointer.

function shortNumber(value, digits = 4) {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (value !== 0 && (size >= 1e6 || size < 1e-3)) return value.toExponential(digits - 1);
  return value.toLocaleString("en-US", { maximumSignificantDigits: digits });
}

class ChartHints {
  constructor(figure) {
    this.figure = figure;
    this.svg = figure.querySelector("svg");
    this.scale = JSON.parse(figure.dataset.scale);
    this.names = JSON.parse(figure.dataset.names);
    // Lines are in the order of their names; a line with gaps is several. Colours come again.
    const colourOf = (shape) => this.names.map(({ colour }) => colour)
      .find((colour) => [shape.getAttribute("stroke"), shape.getAttribute("fill")].includes(colour));
    const shapes = [...this.svg.querySelectorAll("polyline, circle")].filter(colourOf);
    this.lines = this.names.map(({ colour }) => {
      const own = [];
      while (shapes.length && colourOf(shapes[0]) === colour) own.push(shapes.shift());
      return own.flatMap((p) => p.tagName === "circle" ? [[+p.getAttribute("cx"), +p.getAttribute("cy")]]
        : p.getAttribute("points").trim().split(" ").map((xy) => xy.split(",").map(Number)));
    });
    this.cursor = Object.assign(document.createElement("div"), { className: "cursor", hidden: true });
    this.tip = Object.assign(document.createElement("div"), { className: "tip", hidden: true });
    figure.append(this.cursor, this.tip);
    this.svg.setAttribute("tabindex", "0");
    this.svg.addEventListener("pointermove", (event) => this.show(this.place(event)));
    this.svg.addEventListener("pointerleave", () => this.hide());
    this.svg.addEventListener("blur", () => this.hide());
    this.svg.addEventListener("keydown", (event) => this.key(event));
  }
  place(event) {
    const box = this.svg.getBoundingClientRect();
    return (event.clientX - box.left) / box.width * this.scale.image;
  }
  key(event) {
    const by = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (event.key === "Escape") this.hide();
    if (!by) return;
    event.preventDefault();
    this.show((this.at ?? this.scale.left) + by * this.scale.width / 60);
  }
  show(at) {
    const s = this.scale;
    if (at < s.left - 4 || at > s.left + s.width + 4) return this.hide();
    this.at = at;
    const x = s.x[0] + (at - s.left) / s.width * (s.x[1] - s.x[0]);
    const rows = this.lines.map((points, k) => {
      const nearest = points.reduce((best, p) => Math.abs(p[0] - at) < Math.abs(best[0] - at) ? p : best, points[0] ?? [NaN, NaN]);
      const value = s.y[1] - (nearest[1] - s.top) / s.height * (s.y[1] - s.y[0]);
      const row = document.createElement("div"), mark = document.createElement("i");
      mark.style.background = this.names[k].colour;
      row.append(mark, `${this.names[k].name} ${shortNumber(value)} ${s.yUnit}`);
      return row;
    });
    const head = document.createElement("b");
    head.textContent = `${s.xName} ${shortNumber(x)} ${s.xUnit}`;
    this.tip.replaceChildren(head, ...rows);
    this.cursor.hidden = this.tip.hidden = false;
    const box = this.svg.getBoundingClientRect(), outer = this.figure.getBoundingClientRect();
    const left = at / s.image * box.width, top = box.top - outer.top, factor = box.width / s.image;
    Object.assign(this.cursor.style, { left: `${left}px`, top: `${top + s.top * factor}px`, bottom: "auto", height: `${s.height * factor}px` });
    const right = left + 14 + this.tip.offsetWidth > outer.width;
    Object.assign(this.tip.style, { left: `${Math.max(0, right ? left - 14 - this.tip.offsetWidth : left + 14)}px`, top: `${top + 24}px` });
  }
  hide() {
    this.cursor.hidden = this.tip.hidden = true;
    this.at = undefined;
  }
}


// The timeline: rows per thread, zoom and selection. Axes, cursor and zoom by dragging are uPlot's.

class Timeline {
  constructor(trace, colouring, host, events) {
    Object.assign(this, { trace, colouring, host, events });
    this.painter = new RowPainter(trace, colouring);
    this.selected = -1;
    this.hovered = null;
    this.showMessages = true;
    const rows = trace.rows.length;
    this.rowSize = Math.max(6, Math.min(30, Math.floor(520 / rows)));
    this.tip = element("div", { class: "tip", hidden: true, role: "tooltip" });
    this.plot = new uPlot(this.options(rows), [[0, trace.view.span], [null, null]], host);
    this.overlay = element("canvas", { class: "overlay" });
    this.plot.over.append(this.overlay, this.tip);
    this.listen();
    theme.listeners.push(() => this.redraw());
    followWidth(host, (width) => {
      if (width !== this.plot.width) this.plot.setSize({ width, height: this.height(rows) });
    });
  }

  options(rows) {
    const { trace } = this;
    const ink = () => theme.css("ink"), line = () => theme.css("line");
    return {
      width: this.host.clientWidth,
      height: this.height(rows),
      legend: { show: false },
      padding: [14, 8, 0, 0],
      cursor: {
        y: false, points: { show: false }, drag: { x: true, y: false, dist: 4 },
        bind: { mousedown: (u, target, handle) => (e) => (e.shiftKey ? null : handle(e)) },
      },
      scales: {
        x: { time: false, range: (u, min, max) => this.allowed(min, max) },
        y: { range: [0, rows], dir: -1 },
      },
      series: [{}, { show: true, paths: () => null, points: { show: false } }],
      axes: [
        { stroke: ink, grid: { stroke: line, width: 1 }, ticks: { stroke: line, width: 1 },
          values: (u, splits) => splits.map((t) => moment(t, this.span())), space: 90, size: 30 },
        { stroke: ink, grid: { show: false }, ticks: { show: false }, gap: 4,
          size: () => this.labelSize(),
          splits: () => trace.rows.map((_, r) => r + 0.5),
          values: () => trace.rows.map((row, r) => this.labelOf(row, r)) },
      ],
      hooks: {
        draw: [(u) => this.draw(u)],
        setScale: [(u, key) => { if (key === "x") this.events.range(u.scales.x.min, u.scales.x.max); }],
        setCursor: [() => this.hover()],
      },
    };
  }
  height(rows) { return rows * this.rowSize + 44; }
  narrow() { return this.host.clientWidth < 640; }
  labelSize() { return this.narrow() ? 40 : 126; }
  labelOf(row, r) {
    if (this.narrow()) return row.brief;
    const every = Math.ceil(11 / this.rowSize);  // labels that would overlap are left out
    return r % every === 0 ? row.label : "";
  }
  span() { return this.plot ? this.plot.scales.x.max - this.plot.scales.x.min : this.trace.view.span; }

  /** A range within the run, of at least 200 ns. */
  allowed(min, max) {
    const all = this.trace.view.span;
    const span = Math.min(all, Math.max(max - min, Math.min(2e-7, all)));
    const middle = 0.5 * (min + max);
    const from = Math.max(0, Math.min(middle - span / 2, all - span));
    return [from, from + span];
  }
  setRange(min, max) { this.plot.setScale("x", { min, max }); }
  zoom(factor, around = null) {
    const { min, max } = this.plot.scales.x, at = around ?? 0.5 * (min + max);
    this.setRange(at - (at - min) * factor, at + (max - at) * factor);
  }
  pan(share) {
    const { min, max } = this.plot.scales.x, by = share * (max - min);
    const from = Math.max(0, Math.min(min + by, this.trace.view.span - (max - min)));
    this.setRange(from, from + max - min);
  }
  all() { this.setRange(0, this.trace.view.span); }

  redraw() { this.plot.redraw(false, true); }

  listen() {
    const over = this.plot.over;
    over.addEventListener("wheel", (e) => {
      e.preventDefault();
      if (e.shiftKey || Math.abs(e.deltaX) > Math.abs(e.deltaY))
        return this.pan((e.deltaX || e.deltaY) / 800);
      this.zoom(Math.exp(Math.max(-0.7, Math.min(0.7, e.deltaY / 400))), this.timeAt(e.offsetX));
    }, { passive: false });
    let pressed = null;
    over.addEventListener("mousedown", (e) => {
      pressed = { x: e.clientX, y: e.clientY, pan: e.shiftKey, last: e.clientX };
    });
    addEventListener("mousemove", (e) => {
      if (!pressed?.pan) return;
      this.pan((pressed.last - e.clientX) / over.clientWidth);
      pressed.last = e.clientX;
    });
    addEventListener("mouseup", (e) => {
      const click = pressed && Math.hypot(e.clientX - pressed.x, e.clientY - pressed.y) < 4;
      pressed = null;
      if (!click) return;
      const place = over.getBoundingClientRect();
      this.events.select(this.under(e.clientX - place.left, e.clientY - place.top)?.task ?? -1);
    });
    over.addEventListener("mouseleave", () => { this.hovered = null; this.hover(); });
    this.host.addEventListener("keydown", (e) => {
      const act = { ArrowLeft: () => this.pan(-0.2), ArrowRight: () => this.pan(0.2),
                    "+": () => this.zoom(0.6), "=": () => this.zoom(0.6), "-": () => this.zoom(1.6),
                    0: () => this.all(), Escape: () => this.events.select(-1) }[e.key];
      if (!act || e.ctrlKey || e.metaKey) return;
      e.preventDefault();
      act();
    });
  }

  timeAt(x) { return this.plot.posToVal(x, "x"); }
  /** What is at a place of the plot, in its pixels. */
  under(x, y) {
    const r = Math.floor(y / (this.plot.over.clientHeight / this.trace.rows.length));
    return this.trace.at(r, this.timeAt(x), 2 * this.span() / this.plot.over.clientWidth);
  }

  hover() {
    const { left, top } = this.plot.cursor;
    const found = left >= 0 ? this.under(left, top) : null;
    const same = found?.task === this.hovered?.task && found?.interval === this.hovered?.interval;
    this.hovered = found;
    this.tip.hidden = !found;
    if (found) {
      if (!same) this.tip.replaceChildren(...hintOf(this.trace, this.colouring, found));
      const width = this.plot.over.clientWidth;
      this.tip.style.left = `${Math.max(0, Math.min(left + 14, width - this.tip.offsetWidth - 4))}px`;
      this.tip.style.top = `${top + 18}px`;
    }
    if (!same) this.drawOverlay();
  }

  select(task, show = false) {
    this.selected = task;
    if (show && task >= 0) {
      const { tasks } = this.trace, chain = this.trace.chainOf(task, 4);
      const from = Math.min(tasks.ready[task], tasks.begin[chain.at(-1)]), to = tasks.end[task];
      this.setRange(from - 0.3 * (to - from), to + 0.3 * (to - from));
    }
    this.drawOverlay();
  }

  draw(u) {
    const { ctx, bbox } = u, { min, max } = u.scales.x;
    ctx.save();
    this.single = this.painter.paint(ctx, bbox, min, max, bbox.height / this.trace.rows.length,
                                     devicePixelRatio);
    this.drawSteps(ctx, bbox, min, max);
    ctx.restore();
    this.drawOverlay();
  }

  /** When steps were complete: lines where they are far apart, names where there is room. */
  drawSteps(ctx, box, min, max) {
    const { steps } = this.trace, k = box.width / (max - min), ratio = devicePixelRatio;
    const a = firstOf(0, steps.length, (i) => steps[i].time >= min);
    const b = firstOf(a, steps.length, (i) => steps[i].time > max);
    const apart = (b - a) * 60 * ratio < box.width;
    ctx.font = `${10 * ratio}px system-ui, sans-serif`;
    ctx.textAlign = "right";
    ctx.fillStyle = theme.css("soft");
    let free = box.left;
    for (let i = a; i < b; ++i) {
      const x = box.left + (steps[i].time - min) * k, name = `step ${steps[i].step}`;
      const from = x - 3 * ratio - ctx.measureText(name).width, named = from > free;
      if (named) {
        ctx.fillText(name, x - 3 * ratio, box.top - 3 * ratio);
        free = x + 4 * ratio;
      }
      ctx.fillRect(x, box.top - (named ? 11 : 5) * ratio, ratio,
                   (named ? 11 : 5) * ratio + (apart ? box.height : 0));
    }
  }

  drawOverlay() {
    const { overlay, plot, trace } = this;
    if (!overlay || !plot) return;
    const ratio = devicePixelRatio, width = plot.over.clientWidth, height = plot.over.clientHeight;
    overlay.width = Math.round(width * ratio);
    overlay.height = Math.round(height * ratio);
    const ctx = overlay.getContext("2d");
    ctx.scale(ratio, ratio);
    const links = new LinkPainter(trace, ctx, plot.scales.x, width, height);
    if (this.single && this.showMessages) links.allMessages();
    if (this.colouring.focusName === "path") links.path();
    if (this.hovered?.task !== undefined) links.ofTask(this.hovered.task);
    if (this.selected >= 0) links.chain(this.selected);
  }
}

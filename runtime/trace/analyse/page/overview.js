// Charts over the run's time: how many workers were busy, and with what; counters.

/** Charts are as wide as their places; on paper as A4 is between its margins [CSS pixels]. */
const sheet = { width: 680, printed: false, fits: [] };

/** Call fit(width) whenever a chart has to have another width. */
function followWidth(host, fit) {
  const now = () => {
    const width = sheet.printed ? sheet.width : host.clientWidth;
    if (width > 0) fit(width);
  };
  new ResizeObserver(now).observe(host);
  sheet.fits.push(now);
}

/** While the page is printed it is light, and its charts fit the paper. */
function preparePrints() {
  let before = null;
  const change = (printed, name) => {
    sheet.printed = printed;
    theme.choose(name);
    for (const fit of sheet.fits) fit();
  };
  addEventListener("beforeprint", () => {
    if (!sheet.printed) before = theme.chosen;
    change(true, "light");
  });
  addEventListener("afterprint", () => change(false, before));
}

class Overview {
  constructor(trace, colouring, host, range) {
    Object.assign(this, { trace, colouring, host, range });
    this.make();
    theme.listeners.push(() => this.make());
    followWidth(host, (width) => {
      if (width !== this.plot.width) this.plot.setSize({ width, height: this.plot.height });
      this.show(...(this.shown ?? [0, trace.view.span]));
    });
  }

  /** Busy workers by category and bin, each on top of those before. */
  sums(bins) {
    const { trace, colouring } = this, { span } = trace.view, scale = bins / span;
    const sums = Array.from({ length: colouring.size }, () => new Float64Array(bins));
    const add = (category, begin, end) => {
      const x0 = Math.max(0, begin * scale), x1 = Math.min(bins, end * scale);
      for (let b = Math.floor(x0); b < x1; ++b)
        sums[category][b] += Math.max(0, Math.min(x1, b + 1) - Math.max(x0, b));
    };
    const focus = colouring.focus;
    colouring.focus = null;
    for (let i = 0; i < trace.tasks.n; ++i) colouring.parts(i, add);
    colouring.focus = focus;
    for (let c = 1; c < sums.length; ++c)
      for (let b = 0; b < bins; ++b) sums[c][b] += sums[c - 1][b];
    return sums;
  }

  make() {
    const { trace, colouring, host } = this, bins = 400, { span } = trace.view;
    const used = colouring.names.map((_, i) => i).concat([colouring.unpack, colouring.dt, colouring.post, colouring.rest]);
    const sums = this.sums(bins), colours = colouring.colours();
    const times = Float64Array.from({ length: bins }, (_, b) => (b + 0.5) * span / bins);
    const workers = trace.run.threads.reduce((a, b) => a + b, 0);
    const ink = () => theme.css("ink"), line = () => theme.css("line");
    this.plot?.destroy();
    this.plot = new uPlot({
      width: host.clientWidth, height: 130, legend: { show: false }, padding: [8, 8, 0, 0],
      cursor: { y: false, points: { show: false }, drag: { x: true, y: false, setScale: false, dist: 3 } },
      scales: { x: { time: false, range: [0, span] }, y: { range: [0, workers] } },
      series: [{}, ...used.toReversed().map((c) => ({
        stroke: "transparent", fill: colours[c], width: 0, points: { show: false },
        paths: uPlot.paths.stepped({ align: 1 }) }))],
      axes: [
        { stroke: ink, grid: { show: false }, ticks: { stroke: line }, size: 28, space: 90,
          values: (u, splits) => splits.map((t) => moment(t, span)) },
        { stroke: ink, grid: { stroke: line }, ticks: { show: false }, gap: 4, space: 24,
          size: () => (host.clientWidth < 640 ? 40 : 126),
          incrs: [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000, 100000],
          values: (u, splits) => splits.map((n) => (n === workers || host.clientWidth < 640 ? `${n}` : n === 0 ? "0 workers" : `${n}`)) },
      ],
      hooks: { setSelect: [(u) => {
        if (this.quiet || u.select.width < 2) return;
        this.range(u.posToVal(u.select.left, "x"), u.posToVal(u.select.left + u.select.width, "x"));
      }] },
    }, [times, ...used.toReversed().map((c) => sums[c])], host);
    if (this.shown) this.show(...this.shown);
  }

  /** Mark what the timeline shows. */
  show(from, to) {
    this.shown = [from, to];
    const left = this.plot.valToPos(from, "x"), right = this.plot.valToPos(to, "x");
    this.quiet = true;
    const all = to - from > 0.999 * this.trace.view.span;
    this.plot.over.querySelector(".u-select").hidden = all;
    this.plot.setSelect({ left, top: 0, width: Math.max(2, right - left),
                          height: this.plot.over.clientHeight }, false);
    this.quiet = false;
  }
}

/** A counter of each rank; `write` makes text of values, which hold until the next if `stepped`. */
function counterChart(trace, counter, host, write, stepped) {
  const ranks = [...new Set(counter.rank)].sort((a, b) => a - b).slice(0, 12);
  const at = [...new Set(counter.time)].sort((a, b) => a - b);
  const place = new Map(at.map((t, i) => [t, i]));
  const lines = new Map(ranks.map((rank) => [rank, new Array(at.length).fill(null)]));
  for (let i = 0; i < counter.n; ++i)
    lines.get(counter.rank[i])?.splice(place.get(counter.time[i]), 1, counter.value[i]);
  let plot = null;
  const make = () => {
    const set = palettes[theme.dark ? "dark" : "light"], ink = theme.css("ink"), line = theme.css("line");
    plot?.destroy();
    plot = new uPlot({
      width: host.clientWidth, height: 150, padding: [8, 8, 0, 0],
      cursor: { points: { size: 6 }, drag: { x: false, y: false } },
      scales: { x: { time: false, range: [0, trace.view.span] }, y: { range: (u, low, high) => [0, 1.1 * high] } },
      series: [{ label: "time", value: (u, t) => (t === null ? "" : time(t)) }, ...ranks.map((rank) => ({
        label: `rank ${rank}`, stroke: set[rank % set.length], width: 2, spanGaps: true,
        paths: stepped ? uPlot.paths.stepped({ align: 1 }) : undefined,
        points: { show: counter.n < 40 * ranks.length && !stepped },
        value: (u, v) => (v === null || v === undefined ? "" : write(v)) }))],
      axes: [
        { stroke: ink, grid: { show: false }, ticks: { stroke: line }, space: 90,
          values: (u, splits) => splits.map((t) => moment(t, trace.view.span)) },
        { stroke: ink, grid: { stroke: line }, ticks: { show: false }, size: 76,
          values: (u, splits) => splits.map(write) }],
    }, [at, ...lines.values()], host);
  };
  make();
  theme.listeners.push(make);
  followWidth(host, (width) => {
    if (width !== plot.width) plot.setSize({ width, height: plot.height });
  });
}

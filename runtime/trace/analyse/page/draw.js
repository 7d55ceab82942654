// Rows of tasks on a canvas: each task where they are few, else how much of each pixel they fill.

class RowPainter {
  constructor(trace, colouring) {
    this.trace = trace;
    this.colouring = colouring;
  }

  /** Draw onto `ctx` in `box` (device pixels) the times [from, to]. Returns whether tasks are single. */
  paint(ctx, box, from, to, rowHeight, ratio) {
    const { trace } = this;
    const columns = Math.max(1, Math.ceil(box.width / ratio));
    this.colours = this.colouring.colours();
    this.area = { ctx, box, from, to, columns, ratio, k: box.width / (to - from) };
    const parts = trace.rows.map((row) => this.visible(row.tasks, trace.tasks, from, to));
    const single = parts.every(([a, b]) => b - a < columns / 3);
    const cells = single ? null : new Float32Array(this.colouring.size * columns);
    const idle = theme.css("idle"), line = theme.css("row-line");
    trace.rows.forEach((row, r) => {
      const top = box.top + r * rowHeight, pad = rowHeight > 8 * ratio ? ratio : 0;
      const height = rowHeight - 2 * pad;
      ctx.fillStyle = idle;
      ctx.fillRect(box.left, top + pad, box.width, height);
      if (single) this.singles(row, parts[r], top + pad, height);
      else this.fractions(row, parts[r], top + pad, height, cells);
      if (r > 0 && trace.rows[r - 1].rank !== row.rank) {
        ctx.fillStyle = line;
        ctx.fillRect(box.left, top - ratio / 2, box.width, ratio);
      }
    });
    return single;
  }

  /** Those of a list, sorted by beginning, that are in view; the one before may reach into it. */
  visible(list, spans, from, to) {
    const a = firstOf(0, list.length, (k) => spans.begin[list[k]] >= from);
    const b = firstOf(a, list.length, (k) => spans.begin[list[k]] > to);
    return [Math.max(0, a - 1), b];
  }

  singles(row, [a, b], top, height) {
    const { trace, colouring } = this;
    const { ctx, box, from, k, ratio } = this.area;
    const right = box.left + box.width;
    const block = (category, begin, end) => {
      const x = Math.max(box.left, box.left + (begin - from) * k);
      const width = Math.min(right, Math.max(box.left + (end - from) * k, x + 0.5 * ratio)) - x;
      if (width <= 0 || end < from) return;
      ctx.fillStyle = this.colours[category];
      ctx.fillRect(x, top, width, height);
    };
    const spans = (over) => {
      const [c, d] = this.visible(row.spans, trace.intervals, from, this.area.to);
      for (let i = c; i < d; ++i) {
        const span = row.spans[i], category = colouring.ofInterval(span);
        if ((category === colouring.delay) === over)
          block(category, trace.intervals.begin[span], trace.intervals.end[span]);
      }
    };
    spans(false);
    const gap = theme.css("card");
    for (let t = a; t < b; ++t) {
      const i = row.tasks[t];
      colouring.parts(i, block);
      // A hair's breadth between tasks that follow at once.
      const x = box.left + (trace.tasks.begin[i] - from) * k;
      if ((trace.tasks.end[i] - trace.tasks.begin[i]) * k > 4 * ratio && x > box.left) {
        ctx.fillStyle = gap;
        ctx.fillRect(x, top, 0.5 * ratio, height);
      }
    }
    spans(true);
  }

  /** How much of each pixel's time each category took, stacked from below. */
  fractions(row, [a, b], top, height, cells) {
    const { trace, colouring } = this;
    const { ctx, box, from, to, columns } = this.area;
    cells.fill(0);
    const scale = columns / (to - from);
    const add = (category, begin, end) => {
      const x0 = Math.max(0, (begin - from) * scale), x1 = Math.min(columns, (end - from) * scale);
      if (x1 <= x0) return;
      const first = Math.floor(x0), last = Math.min(columns - 1, Math.floor(x1));
      const base = category * columns;
      if (first === last) {
        cells[base + first] += x1 - x0;
        return;
      }
      cells[base + first] += first + 1 - x0;
      for (let c = first + 1; c < last; ++c) cells[base + c] += 1;
      cells[base + last] += x1 - last;
    };
    for (let t = a; t < b; ++t) colouring.parts(row.tasks[t], add);
    const [c, d] = this.visible(row.spans, trace.intervals, from, to);
    for (let i = c; i < d; ++i) {
      const span = row.spans[i], category = colouring.ofInterval(span);
      if (category !== colouring.delay)
        add(category, trace.intervals.begin[span], trace.intervals.end[span]);
    }
    const width = box.width / columns, filled = new Float32Array(columns);
    for (let category = 0; category < colouring.size; ++category) {
      ctx.fillStyle = this.colours[category];
      for (let x = 0; x < columns; ++x) {
        const share = Math.min(cells[category * columns + x], 1 - filled[x]);
        if (share < 0.005) continue;
        filled[x] += share;
        ctx.fillRect(box.left + x * width, top + height * (1 - filled[x]), width, height * share);
      }
    }
  }
}

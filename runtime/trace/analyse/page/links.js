// What connects tasks, drawn over the rows.

class LinkPainter {
  constructor(trace, ctx, scale, width, height) {
    Object.assign(this, { trace, ctx, width, height, from: scale.min, to: scale.max });
    this.k = width / (scale.max - scale.min);
    this.row = height / trace.rows.length;
    this.firstRow = new Map();
    trace.rows.forEach((row, r) => {
      if (!this.firstRow.has(row.rank)) this.firstRow.set(row.rank, r);
    });
  }
  x(moment) { return Math.max(-1e4, Math.min(1e4, (moment - this.from) * this.k)); }
  y(task) { return (this.trace.rowOfTask[task] + 0.5) * this.row; }

  line(colour, width, dash, ...points) {
    const { ctx } = this;
    ctx.strokeStyle = colour;
    ctx.lineWidth = width;
    ctx.setLineDash(dash);
    ctx.beginPath();
    points.forEach(([x, y], i) => (i === 0 ? ctx.moveTo(x, y) : ctx.lineTo(x, y)));
    ctx.stroke();
    ctx.setLineDash([]);
  }
  arrowHead(colour, x, y, dx, dy) {
    const { ctx } = this, length = Math.hypot(dx, dy) || 1, [u, v] = [dx / length, dy / length];
    ctx.fillStyle = colour;
    ctx.beginPath();
    ctx.moveTo(x, y);
    ctx.lineTo(x - 7 * u - 3.5 * v, y - 7 * v + 3.5 * u);
    ctx.lineTo(x - 7 * u + 3.5 * v, y - 7 * v - 3.5 * u);
    ctx.fill();
  }
  outline(task, colour, width) {
    const { tasks } = this.trace, { ctx } = this;
    const x = this.x(tasks.begin[task]), end = this.x(tasks.end[task]);
    const top = this.y(task) - this.row / 2;
    if (end < 0 || x > this.width) return;
    if (end - x < 2 * width) {  // too narrow: a mark above and below
      ctx.fillStyle = colour;
      for (const y of [top, top + this.row - 3]) ctx.fillRect((x + end) / 2 - width, y, 2 * width, 3);
      return;
    }
    ctx.strokeStyle = colour;
    ctx.lineWidth = width;
    ctx.strokeRect(x, top + 1, end - x, this.row - 2);
  }

  /** From its posting to when the task that takes it over began. */
  message(m, colour, width, head) {
    const { messages, tasks } = this.trace, sender = messages.sender[m], unpack = messages.unpack[m];
    const y0 = sender >= 0 ? this.y(sender) : (this.firstRow.get(messages.from[m]) + 0.5) * this.row;
    const y1 = unpack >= 0 ? this.y(unpack) : (this.firstRow.get(messages.to[m]) + 0.5) * this.row;
    const x0 = this.x(messages.sent[m]);
    const x1 = this.x(unpack >= 0 ? tasks.begin[unpack] : messages.given[m]);
    this.line(colour, width, [], [x0, y0], [x1, y1]);
    if (head) this.arrowHead(colour, x1, y1, x1 - x0, y1 - y0);
  }
  /** All that are in view, if there are not too many. */
  allMessages() {
    const { messagesBySent: list, messages } = this.trace;
    const a = firstOf(0, list.length, (i) => messages.sent[list[i]] >= this.from - (this.to - this.from));
    const b = firstOf(a, list.length, (i) => messages.sent[list[i]] > this.to);
    if (b - a > 600) return;
    const colour = theme.css("message");
    for (let i = a; i < b; ++i)
      if (messages.given[list[i]] >= this.from) this.message(list[i], colour, 0.8, b - a < 150);
  }

  /** What a task waited for last, and where what it gave went. */
  ofTask(task) {
    const ink = theme.css("ink");
    this.outline(task, ink, 1.5);
    for (const m of this.trace.messagesOf.get(task) ?? []) this.message(m, ink, 1.2, true);
    this.link(task, ink, 1.5);
  }
  link(task, colour, width) {
    const { tasks, messages } = this.trace, input = tasks.last_input[task];
    if (input < 0) return;
    const m = tasks.last_message[task];
    const x0 = this.x(m >= 0 ? messages.sent[m] : tasks.end[input]), x1 = this.x(tasks.begin[task]);
    const y0 = this.y(input), y1 = this.y(task);
    this.line(colour, width, m >= 0 ? [5, 3] : [], [x0, y0], [x1, y1]);
    this.arrowHead(colour, x1, y1, x1 - x0, y1 - y0);
  }

  /** The tasks that led to one, each the last input of the next. */
  chain(task) {
    const chain = this.trace.chainOf(task), colour = theme.css("mark");
    for (const i of chain) {
      this.link(i, colour, 2);
      this.outline(i, colour, i === task ? 3 : 1.8);
    }
  }

  /** The critical path: from task to task. */
  path() {
    const { path, pathKinds, tasks } = this.trace, colour = theme.css("mark");
    const a = firstOf(0, path.n, (i) => path.end[i] >= this.from);
    const b = firstOf(a, path.n, (i) => path.begin[i] > this.to);
    if (b - a > 1500) return;
    let before = -1;
    for (let i = a; i < b; ++i) {
      if (pathKinds[path.kind[i]] !== "tasks" || path.task[i] < 0) continue;
      const task = path.task[i];
      if (before >= 0)
        this.line(colour, 1.5, [], [this.x(tasks.end[before]), this.y(before)],
                  [this.x(tasks.begin[task]), this.y(task)]);
      this.outline(task, colour, 1.5);
      before = task;
    }
  }
}

// What the program put into the page (runtime/trace/analyse/page_data.h).

async function inflate(text) {
  const stream = new Blob([bytesOf(text)]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** A column: bytes by significance, of differences with their sign in the lowest bit. */
async function column(text, n) {
  const bytes = await inflate(text);
  const values = new Int32Array(n);
  let value = 0;
  for (let i = 0; i < n; ++i) {
    const folded = bytes[i] | bytes[n + i] << 8 | bytes[2 * n + i] << 16 | bytes[3 * n + i] << 24;
    value = value + ((folded >>> 1) ^ -(folded & 1)) | 0;
    values[i] = value;
  }
  return values;
}

async function table(packed) {
  const result = { n: packed.count };
  for (const [name, text] of Object.entries(packed))
    if (typeof text === "string" && name !== "name") result[name] = await column(text, packed.count);
  return result;
}

const seconds = (ticks, unit) => Float64Array.from(ticks, (t) => t * unit);

/** First i in [from, to) with test(i), which is false before and true after; `to` if there is none. */
function firstOf(from, to, test) {
  while (from < to) {
    const middle = (from + to) >> 1;
    if (test(middle)) to = middle;
    else from = middle + 1;
  }
  return from;
}

/** Times are in seconds from the view's origin. */
class Trace {
  static async read(source) {
    const trace = new Trace();
    Object.assign(trace, { run: source.run, view: source.view, pathKinds: source.path_kinds,
      waitTasks: source.wait_tasks.map((i) => i - source.view.first_task) });
    trace.kind = Object.fromEntries(source.kinds.map((name, i) => [name, i]));
    const unit = source.view.unit;
    const tasks = await table(source.tasks);
    tasks.begin = seconds(tasks.begin, unit);
    tasks.end = tasks.begin.map((begin, i) => begin + tasks.length[i] * unit);
    tasks.ready = tasks.begin.map((begin, i) => begin - tasks.lag[i] * unit);
    tasks.released = tasks.end.map((end, i) => end + tasks.posting[i] * unit);
    tasks.stage = [];
    for (let s = 0; s < source.tasks.stages; ++s) tasks.stage.push(tasks[`stage${s}`]);
    trace.tasks = tasks;

    const messages = await table(source.messages);
    for (const name of ["packed", "sent", "there", "given"])
      messages[name] = seconds(messages[name], unit);
    trace.messages = messages;
    for (const name of ["intervals", "path"]) {
      const spans = await table(source[name]);
      spans.begin = seconds(spans.begin, unit);
      spans.end = spans.begin.map((begin, i) => begin + spans.length[i] * unit);
      trace[name] = spans;
    }
    trace.counters = {};
    for (const packed of source.counters) {
      const counter = await table(packed);
      trace.counters[packed.name] = { n: counter.n, rank: counter.rank, time: seconds(counter.time, unit),
                                      value: Float64Array.from(counter.value, (v) => v * packed.scale) };
    }
    trace.findRows();
    trace.findMessages();
    trace.onPath = new Uint8Array(tasks.n);
    for (let i = 0; i < trace.path.n; ++i)
      if (trace.pathKinds[trace.path.kind[i]] === "tasks" && trace.path.task[i] >= 0)
        trace.onPath[trace.path.task[i]] = 1;
    return trace;
  }

  /** One row per thread that did something, each with its tasks and intervals by beginning. */
  findRows() {
    const { tasks, intervals, kind } = this;
    const drawn = [kind.poll, kind.completed, kind.frame, kind.checkpoint, kind.trace, kind.delay, kind.direct];
    const rows = new Map();
    const rowOf = (rank, thread) => {
      const key = rank * 65536 + thread;
      if (!rows.has(key)) rows.set(key, { key, rank, thread, tasks: [], spans: [] });
      return rows.get(key);
    };
    for (let i = 0; i < tasks.n; ++i) rowOf(tasks.rank[i], tasks.thread[i]).tasks.push(i);
    for (let i = 0; i < intervals.n; ++i)
      if (drawn.includes(intervals.kind[i]))
        rowOf(intervals.rank[i], intervals.thread[i]).spans.push(i);
    this.rows = [...rows.values()].sort((a, b) => a.key - b.key);
    this.rowOfTask = new Int32Array(tasks.n);
    this.rows.forEach((row, r) => {
      row.spans.sort((a, b) => intervals.begin[a] - intervals.begin[b]);
      for (const i of row.tasks) this.rowOfTask[i] = r;
      const works = row.tasks.length > 0 ||
        row.spans.some((i) => [kind.poll, kind.completed, kind.direct].includes(intervals.kind[i]));
      row.label = `${this.run.ranks > 1 ? `rank ${row.rank} · ` : ""}${
        works ? "thread" : "writer"} ${row.thread}`;
      row.brief = `${this.run.ranks > 1 ? `${row.rank}·` : ""}${row.thread}`;
    });
    this.steps = [];  // when steps were known to be complete, on rank 0
    for (let i = 0; i < intervals.n; ++i)
      if (intervals.kind[i] === kind.completed && intervals.rank[i] === 0)
        this.steps.push({ step: intervals.step[i], time: intervals.end[i] });
    this.steps.sort((a, b) => a.time - b.time);
  }

  /** Messages by their posting, and those of each task. */
  findMessages() {
    const { messages } = this;
    this.messagesOf = new Map();
    const order = [];
    for (let m = 0; m < messages.n; ++m) {
      order.push(m);
      if (messages.sender[m] < 0) continue;
      if (!this.messagesOf.has(messages.sender[m])) this.messagesOf.set(messages.sender[m], []);
      this.messagesOf.get(messages.sender[m]).push(m);
    }
    this.messagesBySent = order.sort((a, b) => messages.sent[a] - messages.sent[b]);
  }

  /** Tasks that led to task i, each the last input of the one before; itself first. */
  chainOf(i, most = 60) {
    const chain = [];
    for (; i >= 0 && chain.length < most; i = this.tasks.last_input[i]) chain.push(i);
    return chain;
  }

  /** "step 3", or "step 3 · round 210" in a loop of a solver. */
  turnOf(i) {
    const { step, round } = this.tasks;
    return `step ${step[i]}${round[i] < 0 ? "" : ` · round ${round[i]}`}`;
  }

  nameOf(i) {
    const { tasks, kind, run } = this;
    if (tasks.kind[i] === kind.dt) return tasks.round[i] < 0 ? "time step" : "sums of a round";
    const phase = run.phases[tasks.phase[i]].name;
    return tasks.kind[i] === kind.unpack ? `message after ${phase}` : phase;
  }

  /** The task or interval of a row at a time, within `reach` seconds. */
  at(r, moment, reach) {
    const { tasks, intervals } = this, row = this.rows[r];
    if (!row) return null;
    let best = null, distance = reach;
    const next = firstOf(0, row.tasks.length, (k) => tasks.begin[row.tasks[k]] > moment);
    for (const k of [next - 1, next]) {
      const i = row.tasks[k];
      if (i === undefined) continue;
      const off = Math.max(tasks.begin[i] - moment, moment - tasks.end[i], 0);
      if (off === 0 ? distance > 0 || best === null : off < distance) [best, distance] = [i, off];
    }
    if (best !== null) return { task: best };
    const span = row.spans[firstOf(0, row.spans.length,
      (k) => intervals.begin[row.spans[k]] > moment) - 1];
    if (span !== undefined && intervals.end[span] >= moment) return { interval: span };
    return null;
  }
}

// What the program put into the page (runtime/trace/analyse/page_data.h).

/**
 * A code of RFC 1951, from the lengths of its words [bits] by symbol. What a word and the bits after
 * it stand for is found in one look: symbol << 4 | length.
 */
function huffman(lengths) {
  const longest = Math.max(...lengths), table = new Uint16Array(1 << longest);
  let code = 0;
  for (let length = 1; length <= longest; ++length, code <<= 1)
    for (let symbol = 0; symbol < lengths.length; ++symbol) {
      if (lengths[symbol] !== length) continue;
      let word = 0;  // the code's bits come highest first, all others lowest first
      for (let bit = 0; bit < length; ++bit) word |= (code >> bit & 1) << (length - 1 - bit);
      for (; word < table.length; word += 1 << length) table[word] = symbol << 4 | length;
      ++code;
    }
  return { table, longest };
}

/** [least value, bits after it] of the symbols for lengths and distances of what comes again. */
const again = {
  lengths: Array.from({ length: 29 }, (_, k) => (k < 8 ? [k + 3, 0] : k === 28 ? [258, 0]
    : [(4 + (k & 3) << (k >> 2) - 1) + 3, (k >> 2) - 1])),
  distances: Array.from({ length: 30 }, (_, k) => (k < 4 ? [k + 1, 0]
    : [(2 + (k & 1) << (k >> 1) - 1) + 1, (k >> 1) - 1])),
};

/** Bytes that zlib deflated. Browsers inflate too, but later: who prints a page does not wait. */
class Inflater {
  constructor(bytes, size) {
    Object.assign(this, { bytes, at: 2, word: 0, bits: 0, out: new Uint8Array(size), n: 0 });
    for (let last = 0; !last;) {
      last = this.take(1);
      const kind = this.take(2);
      if (kind === 0) this.stored();
      else this.block(...(kind === 1 ? Inflater.fixed() : this.codes()));
    }
    if (this.n !== size) throw new Error("the data of this page is damaged");
  }
  static fixed() {
    const lengths = Array.from({ length: 288 },
                               (_, k) => (k < 144 ? 8 : k < 256 ? 9 : k < 280 ? 7 : 8));
    return [huffman(lengths), huffman(new Array(30).fill(5))];
  }

  need(n) {
    for (; this.bits < n; this.bits += 8) this.word |= this.bytes[this.at++] << this.bits;
  }
  drop(n) {
    this.word >>>= n;
    this.bits -= n;
  }
  take(n) {
    this.need(n);
    const value = this.word & (1 << n) - 1;
    this.drop(n);
    return value;
  }
  symbol({ table, longest }) {
    this.need(longest);
    const found = table[this.word & table.length - 1];
    this.drop(found & 15);
    return found >> 4;
  }

  stored() {
    this.drop(this.bits & 7);
    const end = this.n + this.take(16);
    this.take(16);  // the size again
    while (this.n < end) this.out[this.n++] = this.take(8);
  }
  /** The codes of a block, whose lengths are coded themselves. */
  codes() {
    const symbols = this.take(5) + 257, distances = this.take(5) + 1, first = new Array(19).fill(0);
    const order = [16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15];
    for (let k = 0, n = this.take(4) + 4; k < n; ++k) first[order[k]] = this.take(3);
    const code = huffman(first), lengths = [];
    while (lengths.length < symbols + distances) {
      const is = this.symbol(code);
      if (is < 16) lengths.push(is);
      else {
        const value = is === 16 ? lengths.at(-1) : 0;
        const times = is === 16 ? 3 + this.take(2)
          : is === 17 ? 3 + this.take(3) : 11 + this.take(7);
        for (let k = 0; k < times; ++k) lengths.push(value);
      }
    }
    return [huffman(lengths.slice(0, symbols)), huffman(lengths.slice(symbols))];
  }
  block(symbols, distances) {
    const { out } = this;
    for (let is = this.symbol(symbols); is !== 256; is = this.symbol(symbols)) {
      if (this.n >= out.length) throw new Error("the data of this page is damaged");
      if (is < 256) {
        out[this.n++] = is;
        continue;
      }
      const [least, bits] = again.lengths[is - 257], end = this.n + least + this.take(bits);
      const [nearest, more] = again.distances[this.symbol(distances)];
      const distance = nearest + this.take(more);
      for (; this.n < end; ++this.n) out[this.n] = out[this.n - distance];
    }
  }
}

/** A column: bytes by significance, of differences with their sign in the lowest bit. */
function column(text, n) {
  const bytes = new Inflater(bytesOf(text), 4 * n).out;
  const values = new Int32Array(n);
  let value = 0;
  for (let i = 0; i < n; ++i) {
    const folded = bytes[i] | bytes[n + i] << 8 | bytes[2 * n + i] << 16 | bytes[3 * n + i] << 24;
    value = value + ((folded >>> 1) ^ -(folded & 1)) | 0;
    values[i] = value;
  }
  return values;
}

function table(packed) {
  const result = { n: packed.count };
  for (const [name, text] of Object.entries(packed))
    if (typeof text === "string" && name !== "name") result[name] = column(text, packed.count);
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
  static read(source) {
    const trace = new Trace();
    Object.assign(trace, { run: source.run, view: source.view, pathKinds: source.path_kinds,
      waitTasks: source.wait_tasks.map((i) => i - source.view.first_task) });
    trace.kind = Object.fromEntries(source.kinds.map((name, i) => [name, i]));
    const unit = source.view.unit;
    const tasks = table(source.tasks);
    tasks.begin = seconds(tasks.begin, unit);
    tasks.end = tasks.begin.map((begin, i) => begin + tasks.length[i] * unit);
    tasks.ready = tasks.begin.map((begin, i) => begin - tasks.lag[i] * unit);
    tasks.released = tasks.end.map((end, i) => end + tasks.posting[i] * unit);
    tasks.stage = [];
    for (let s = 0; s < source.tasks.stages; ++s) tasks.stage.push(tasks[`stage${s}`]);
    trace.tasks = tasks;

    const messages = table(source.messages);
    for (const name of ["packed", "sent", "there", "given"])
      messages[name] = seconds(messages[name], unit);
    trace.messages = messages;
    for (const name of ["intervals", "path"]) {
      const spans = table(source[name]);
      spans.begin = seconds(spans.begin, unit);
      spans.end = spans.begin.map((begin, i) => begin + spans.length[i] * unit);
      trace[name] = spans;
    }
    trace.counters = {};
    for (const packed of source.counters) {
      const counter = table(packed);
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

// Colours that people with any colour vision tell apart: after Okabe and Ito (2008), "Color
// universal design", lighter ones where the page is dark.

const palettes = {
  light: ["#0072b2", "#e69f00", "#009e73", "#cc79a7", "#d55e00", "#56b4e9", "#7f5fb0", "#a89400",
          "#7a4a2b", "#3f8f8f", "#b04a6f", "#6d8f3a"],
  dark: ["#3f9bdc", "#f2b134", "#22b78c", "#df94bf", "#f0803c", "#8ccdf5", "#ae94da", "#d8c93a",
         "#c49a7a", "#7cc7c7", "#e58aa8", "#a9cc6e"],
};
const others = {
  light: { unpack: "#33415c", dt: "#b0002a", rest: "#93a1b5", post: "#a0527c", ends: "#4a7fb5", output: "#6b7c32", writing: "#5b4a66",
           direct: "#8c6d1f", delay: "#111111", poll: "#b3b9c4", dim: "#cfd4dc" },
  dark: { unpack: "#c3cede", dt: "#ff7b7b", rest: "#6f7d92", post: "#e9b3d0", ends: "#9cc4ea", output: "#c2d27a", writing: "#b7a2c4",
          direct: "#e0c068", delay: "#ffffff", poll: "#565f6e", dim: "#3d4552" },
};

/** What is coloured, by phase or by stage: categories, and the parts of a task. */
class Colouring {
  constructor(trace) {
    this.trace = trace;
    this.phases = trace.run.phases.map((phase) => phase.name);
    this.stages = [...new Set(trace.run.phases.flatMap((phase) => phase.stages))];
    this.stageIndex = trace.run.phases.map((p) => p.stages.map((s) => this.stages.indexOf(s)));
    this.by = this.phases.length > 2 ? "phase" : "stage";
    this.focus = null;  // null, or (task) => whether it is not dimmed
  }
  set by(what) {
    this.mode = what;
    this.names = what === "phase" ? this.phases : this.stages;
    const extra = ["unpack", "dt", "post", "rest", "dim", "ends", "output", "writing", "direct", "delay", "poll"];
    this.size = this.names.length + extra.length;
    extra.forEach((name, k) => { this[name] = this.names.length + k; });
    this.extra = extra;
  }
  get by() { return this.mode; }

  colours() {
    const set = theme.dark ? "dark" : "light";
    return [...this.names.map((_, i) => palettes[set][i % palettes[set].length]),
            ...this.extra.map((name) => others[set][name])];
  }
  legend() {
    const colours = this.colours();
    const texts = { unpack: "message taken over", dt: this.trace.tasks.round.some((r) => r >= 0) ? "time step, sums" : "time step", rest: "between stages",
                    post: "posting messages", ends: "end of a step", output: "writing files", poll: "looking for messages", direct: "direct solve", delay: "delay for a study" };
    const seen = new Set(this.trace.intervals.kind);
    const { kind } = this.trace;
    const has = { unpack: this.trace.messages.n > 0, post: this.trace.messages.n > 0, rest: this.by === "stage",
                  ends: seen.has(kind.completed),
                  dt: this.trace.tasks.kind.includes(kind.dt), poll: seen.has(kind.poll),
                  output: seen.has(kind.frame) || seen.has(kind.checkpoint),
                  direct: seen.has(kind.direct), delay: seen.has(kind.delay) };
    return [...this.names.map((name, i) => ({ name, colour: colours[i] })),
            ...this.extra.filter((name) => has[name])
                         .map((name) => ({ name: texts[name], colour: colours[this[name]] }))];
  }
  ofInterval(i) {
    const { kind, intervals } = this.trace, is = intervals.kind[i];
    if (is === kind.poll) return this.poll;
    if (is === kind.completed) return this.ends;
    if (is === kind.trace) return this.writing;
    if (is === kind.direct) return this.direct;
    return is === kind.delay ? this.delay : this.output;
  }
  /** Call each(category, begin, end) for the coloured parts of a task: stages follow each other. */
  parts(i, each) {
    const { tasks, kind, view } = this.trace, begin = tasks.begin[i], end = tasks.end[i];
    if (tasks.posting[i] > 0) each(this.focus ? this.dim : this.post, end, tasks.released[i]);
    if (this.focus && !this.focus(i)) return each(this.dim, begin, end);
    if (tasks.kind[i] === kind.unpack) return each(this.unpack, begin, end);
    if (tasks.kind[i] === kind.dt) return each(this.dt, begin, end);
    if (this.by === "phase") return each(tasks.phase[i], begin, end);
    let from = begin;
    const of = this.stageIndex[tasks.phase[i]];
    for (let s = 0; s < of.length && s < tasks.stage.length; ++s) {
      const length = tasks.stage[s][i] * view.unit;
      if (length <= 0) continue;
      const to = Math.min(from + length, end);
      each(of[s], from, to);
      from = to;
    }
    if (end > from) each(this.rest, from, end);
  }
}

// What is said about a task or an interval: beside the pointer, and below when it is selected.

const ofPatch = (tasks, i) => (tasks.patch[i] >= 0 ? ` of patch ${tasks.patch[i]}` : "");

/** What a task waited for last, in words. */
function waitedFor(trace, i) {
  const { tasks, messages, kind, run } = trace, m = tasks.last_message[i], input = tasks.last_input[i];
  if (m >= 0)
    return `the message after ${run.phases[messages.phase[m]].name} of patch ${messages.patch[m]}` +
      ` from rank ${messages.from[m]} (${bytes(messages.bytes[m])}, ${
        time(Math.max(0, messages.there[m] - messages.sent[m]))} on its way, ${
        time(messages.given[m] - messages.there[m])} until somebody looked for it)`;
  if (input >= 0) {
    const same = tasks.step[input] === tasks.step[i] && tasks.round[input] === tasks.round[i];
    const step = same ? "" : `, ${trace.turnOf(input)}`;
    return `${trace.nameOf(input)}${ofPatch(tasks, input)}${step}`;
  }
  if (tasks.lag[i] === 0) return "nothing that is in this timeline";
  return tasks.kind[i] === kind.dt
    ? `the agreement of all ranks on ${tasks.round[i] < 0 ? "the time step" : "the sums of a round"}`
    : "the slowest patches: the step could not begin before an earlier one was complete everywhere";
}

/** [name, seconds, colour] of the stages of a task. */
function stagesOf(trace, colouring, i) {
  const { tasks, kind, run, view } = trace;
  if (tasks.kind[i] !== kind.task) return [];
  const set = theme.dark ? "dark" : "light", rest = colouring.by === "stage";
  return run.phases[tasks.phase[i]].stages.map((name, s) => [
    name, (tasks.stage[s]?.[i] ?? 0) * view.unit,
    rest ? colouring.colours()[colouring.stages.indexOf(name)]
         : palettes[set][colouring.stages.indexOf(name) % palettes[set].length]]);
}

function hintOf(trace, colouring, found) {
  const { tasks, intervals, kind } = trace;
  if (found.interval !== undefined) {
    const i = found.interval, length = intervals.end[i] - intervals.begin[i];
    const names = { [kind.poll]: "looking for messages, without a task", [kind.frame]: "writes a frame",
                    [kind.checkpoint]: "writes a checkpoint", [kind.trace]: "writes the trace",
                    [kind.completed]: `what is done when step ${intervals.step[i]} is finished`,
                    [kind.direct]: "solves a linear system directly",
                    [kind.delay]: "delayed on purpose, for a study" };
    return [element("b", {}, names[intervals.kind[i]]), element("div", {}, time(length))];
  }
  const i = found.task, row = trace.rows[trace.rowOfTask[i]], length = tasks.end[i] - tasks.begin[i];
  const stages = stagesOf(trace, colouring, i).filter(([, t]) => t > 0).sort((a, b) => b[1] - a[1]);
  return [
    element("b", {}, trace.nameOf(i)),
    element("div", {}, `${tasks.patch[i] >= 0 ? `patch ${tasks.patch[i]} · ` : ""}${trace.turnOf(i)} · ${row.label}`),
    element("div", {}, `took ${time(length)}; ${startOf(tasks, i)}`),
    ...stages.slice(0, 4).map(([name, t, colour]) => element("div", { class: "tip-stage" },
      element("i", { style: `background:${colour}` }), `${name} ${time(t)}`)),
    element("div", { class: "soft" }, `waited for ${waitedFor(trace, i)}`),
  ];
}

function startOf(tasks, i) {
  const lag = tasks.begin[i] - tasks.ready[i];
  return lag > 0 ? `began ${time(lag)} after it was ready` : "began at once";
}

function detailsOf(trace, colouring, i, select) {
  const { tasks, messages } = trace, row = trace.rows[trace.rowOfTask[i]];
  const fact = (name, ...value) => [element("dt", {}, name), element("dd", {}, ...value)];
  const exact = (t) => `${(1e3 * t).toLocaleString("en-US", { minimumFractionDigits: 4, maximumFractionDigits: 4 })} ms`;
  const sent = trace.messagesOf.get(i) ?? [];
  const stages = stagesOf(trace, colouring, i);
  const link = (task) => element("button", { type: "button", class: "link", click: () => select(task) },
    `${trace.nameOf(task)}${ofPatch(tasks, task)}`);
  const chain = trace.chainOf(i, 12).slice(1);
  return [
    element("div", {}, element("h3", {}, `${trace.nameOf(i)}${ofPatch(tasks, i)}`), element("dl", {},
      ...fact("when", trace.turnOf(i)),
      ...fact("where", row.label),
      ...fact("ready", exact(tasks.ready[i])),
      ...fact("began", `${exact(tasks.begin[i])} – ${startOf(tasks, i).replace("began ", "")}`),
      ...fact("ended", `${exact(tasks.end[i])} – took ${time(tasks.end[i] - tasks.begin[i])}`),
      ...fact("waited for", waitedFor(trace, i)),
      ...(sent.length === 0 ? [] : fact("sent", ...sent.map((m) => element("div", {},
        `${bytes(messages.bytes[m])} to rank ${messages.to[m]}, found after ${
          time(messages.given[m] - messages.sent[m])}`)))),
      ...(tasks.kind[i] === trace.kind.task && trace.onPath[i]
        ? fact("critical path", "this task is on it") : [])),
      stages.length > 1 ? shares(stages.map(([name, value, colour]) => ({ name, value, colour })), time) : null),
    chain.length === 0 ? null : element("div", {}, element("h3", {}, "The last input of each, from here back"),
      element("ol", { class: "chain" }, ...chain.map((task) => element("li", {}, link(task),
        ` ${trace.turnOf(task)}, ${trace.rows[trace.rowOfTask[task]].label}: took ${
          time(tasks.end[task] - tasks.begin[task])}, ${startOf(tasks, task)}`)))),
  ].filter((part) => part !== null);
}

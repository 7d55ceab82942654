// Puts the page together.

const embedded = (id) => JSON.parse(byId(id).textContent);

/** A note where the timeline is only a part of the run. */
function noteOnPart(trace) {
  const { view, tasks, run } = trace;
  if (tasks.n === view.all_tasks) return;
  const note = byId("part");
  note.hidden = false;
  note.textContent = `The timeline has ${number(tasks.n)} of ${number(view.all_tasks)} tasks, steps ${
    tasks.step[0]} to ${tasks.step[tasks.n - 1]}, from the middle of the run; everything else on this page ` +
    "is of the whole run. To see other steps, record them: lahar run --trace-steps FIRST:LAST.";
}

function timelinePanel(trace, report) {
  const colouring = new Colouring(trace);
  let overview = null;
  const showRange = (from, to) => {
    byId("range").textContent = `${moment(from, to - from)} – ${moment(to, to - from)} (${time(to - from)})`;
    overview?.show(from, to);
  };
  const select = (task, show = false) => {
    timeline.select(task, show);
    byId("details").replaceChildren(...(task >= 0 ? detailsOf(trace, colouring, task, (i) => select(i, true)) : []));
    byId("details").hidden = task < 0;
  };
  const timeline = new Timeline(trace, colouring, byId("timeline"), { range: showRange, select });
  overview = new Overview(trace, colouring, byId("overview"), (from, to) => timeline.setRange(from, to));
  showRange(0, trace.view.span);

  const legend = () => byId("legend").replaceChildren(...colouring.legend().map(({ name, colour }) =>
    element("li", { title: name }, element("i", { style: `background:${colour}` }), name)),
    element("li", {}, element("i", { class: "idle" }), "idle"));
  const focus = (name, test, label) => {
    const off = test === null || colouring.focusLabel === label;
    Object.assign(colouring, { focus: off ? null : test, focusName: off ? null : name, focusLabel: off ? null : label });
    byId("focus").hidden = off;
    byId("focus-name").textContent = off ? "" : label;
    byId("critical").setAttribute("aria-pressed", String(colouring.focusName === "path"));
    timeline.redraw();
    if (!off && name !== "path") byId("timeline-card").scrollIntoView({ block: "start" });
  };
  legend();
  theme.listeners.push(legend, () => timeline.selected >= 0 && select(timeline.selected));

  for (const [id, act] of Object.entries({ "zoom-in": () => timeline.zoom(0.5), "zoom-out": () => timeline.zoom(2),
      back: () => timeline.pan(-0.5), forth: () => timeline.pan(0.5), whole: () => timeline.all() }))
    byId(id).addEventListener("click", act);
  const by = byId("colour-by");
  by.value = colouring.by;
  by.addEventListener("change", () => {
    colouring.by = by.value;
    legend();
    overview.make();
    timeline.redraw();
    if (timeline.selected >= 0) select(timeline.selected);
  });
  const messages = byId("messages");
  if (trace.messages.n === 0) messages.hidden = true;
  messages.addEventListener("click", () => {
    timeline.showMessages = !timeline.showMessages;
    messages.setAttribute("aria-pressed", String(timeline.showMessages));
    timeline.drawOverlay();
  });
  byId("critical").addEventListener("click", () => focus("path", (i) => trace.onPath[i] === 1, "the critical path"));
  byId("unfocus").addEventListener("click", () => focus(null, null, null));
  return {
    show: (task) => {
      byId("timeline-card").scrollIntoView({ block: "start" });
      select(task, true);
    },
    patch: (row) => focus("patch", (i) => trace.tasks.patch[i] === row.patch, `patch ${row.patch}`),
    phase: (row) => {
      const phase = trace.run.phases.findIndex((p) => p.name === row.phase);
      focus("phase", (i) => trace.tasks.kind[i] === trace.kind.task && trace.tasks.phase[i] === phase, row.phase);
    },
  };
}

function start() {
  themeButton();
  const report = embedded("report");
  const trace = Trace.read(embedded("trace"));
  heading(trace);
  findings(trace, report);
  tiles(report);
  workers(report);
  noteOnPart(trace);
  const timeline = timelinePanel(trace, report);
  byId("stages").replaceChildren(stageTable(report, timeline.phase));
  criticalPath(trace, report);
  exchange(trace, report);
  byId("waits").replaceChildren(waitTable(trace, report, timeline.show));
  byId("patches").replaceChildren(patchTable(report, timeline.patch));
  for (const [id, name, write, stepped] of [["load", "load", percent, true],
      ["particles", "active particles", number, true], ["memory", "memory", bytes, false]]) {
    const counter = trace.counters[name];
    byId(id).parentElement.hidden = counter.n < 2;
    if (counter.n > 1) counterChart(trace, counter, byId(id), write, stepped);
  }
  preparePrints();
  document.documentElement.dataset.ready = "yes";
}

try {
  start();
} catch (error) {
  byId("failure").hidden = false;
  byId("failure").textContent = [].toReversed
    ? `The page could not be drawn: ${error.message}`
    : "This browser is too old for the page: it needs one of 2023 or later.";
  throw error;
}

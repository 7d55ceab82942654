// What the analysis says, beside the timeline.

/** A bar of parts with a legend below. */
function shares(parts, format, total = parts.reduce((sum, part) => sum + part.value, 0)) {
  const shown = parts.filter((part) => part.value > 0);
  return element("div", { class: "shares" },
    stacked(shown, total, format),
    element("ul", { class: "legend" }, ...shown.map((part) => element("li", {},
      element("i", { style: `background:${part.colour}` }), `${part.name} `,
      element("span", { class: "soft" }, `${format(part.value)} (${percent(part.value / total)})`)))));
}
function stacked(parts, total, format) {
  return element("div", { class: "bar", role: "img",
    "aria-label": parts.map((part) => `${part.name} ${percent(part.value / total)}`).join(", ") },
    ...parts.map((part) => element("span", { title: `${part.name}: ${format(part.value)}`,
      style: `width:${100 * part.value / total}%;background:${part.colour}` })));
}

function heading(trace) {
  const { run } = trace, workers = run.threads.reduce((a, b) => a + b, 0);
  const same = run.threads.every((n) => n === run.threads[0]);
  const hosts = [...new Set(run.hosts)];
  document.title = `${run.title || "run"} – trace`;
  document.getElementById("title").textContent = run.title || "A run without a title";
  const fact = (name, value) => element("div", {}, element("dt", {}, name), element("dd", {}, value));
  document.getElementById("facts").replaceChildren(
    fact("ranks × threads", same ? `${run.ranks} × ${run.threads[0]}` : `${run.ranks} (${workers} threads)`),
    fact("steps", `${number(run.last - run.first + 1)} (${run.first} to ${run.last})`),
    fact("time", time(run.wall)),
    fact("per step", time(run.wall / (run.last - run.first + 1))),
    fact("tasks", number(trace.view.all_tasks)),
    fact("scheme", run.scheme),
    fact("executor", run.executor),
    fact(hosts.length === 1 ? "machine" : "machines",
         hosts.length > 3 ? `${hosts.slice(0, 3).join(", ")} and ${hosts.length - 3} more` : hosts.join(", ")),
    ...(run.latency > 0 ? [fact("latency added", time(run.latency))] : []),
    ...(run.ranks > 1 ? [fact("clocks of ranks", run.clock_bound > 0 ? `agree within ${time(run.clock_bound)}` : "are one")] : []),
    fact("Lahar", run.version));
}

/** The run's time is even work of all workers and losses; small ones are not listed. */
function findings(trace, report) {
  const { wall } = trace.run, least = 0.001 * wall;
  const list = (report.findings ?? []).filter((finding) => finding.loss > least);
  const colours = ["--poor", "--runtime", "--messages", "--path-dt", "--other", "--path-unseen", "--polling"];
  const parts = [{ name: "work, spread evenly", value: report.ideal_time, colour: "var(--useful)" },
    ...list.map((finding, i) => ({ name: finding.name, value: finding.loss,
                                   colour: `var(${colours[Math.min(i, colours.length - 1)]})` }))];
  document.getElementById("losses").replaceChildren(shares(parts, time));
  document.getElementById("findings").replaceChildren(...list.map((finding, i) =>
    element("li", { class: i === 0 ? "main" : "" },
      element("div", { class: "loss" }, percent(finding.loss / wall)),
      element("div", {}, element("b", {}, finding.name), element("div", {}, finding.text)))));
  const note = document.getElementById("disturbed");
  note.hidden = !(report.disturbance > 1.3);  // runtime/trace/analyse/analysis.h
  note.textContent = `Tasks took ${number(report.disturbance)} times their median on average. Where work is even, ` +
    "something else ran on these cores, and losses are not the program's alone.";
}

function tiles(report) {
  const e = report.efficiencies, replayed = e.transfer !== undefined;
  const tile = (name, value, means, known = true) => {
    const grade = value >= 0.9 ? "good" : value >= 0.7 ? "fair" : "poor";
    return element("div", { class: `tile ${known ? grade : ""}` },
      element("div", { class: "name" }, name),
      element("div", { class: "value" }, known ? percent(value) : "–"),
      element("div", { class: "meter" }, element("span", { style: `width:${known ? 100 * Math.min(1, value) : 0}%` })),
      element("p", {}, means));
  };
  const sign = (text) => element("div", { class: "sign", "aria-hidden": "true" }, text);
  const replay = replayed ? "" : " Not known: it takes a replay of the trace.";
  document.getElementById("tiles").replaceChildren(
    element("div", { class: "equation" },
      tile("parallel efficiency", e.parallel, "Share of the workers' time that was spent in tasks."), sign("="),
      tile("load balance", e.load_balance, `Mean work of a worker over the most that one had; of ranks alone ${percent(e.load_balance_ranks)}.`), sign("×"),
      tile("communication efficiency", e.communication, "The most that one worker worked over the run's time: what is lost by waiting.")),
    element("div", { class: "equation" },
      tile("communication efficiency", e.communication, "As above, and made of:"), sign("="),
      tile("serialisation", e.serialisation, `What would be left on an ideal network: tasks that wait for tasks.${replay}`, replayed), sign("×"),
      tile("transfer", e.transfer, `The run's time on an ideal network over its time: what moving data costs.${replay}`, replayed)));
}

function workerParts(worker) {
  const colours = { useful: "--useful", messages: "--messages", runtime: "--runtime", polling: "--polling",
                    other: "--other", idle: "--idle-strong" };
  const names = { useful: "tasks", messages: "taking over messages", runtime: "task graph",
                  polling: "looking for messages", other: "files and other", idle: "idle" };
  return Object.keys(colours).map((key) => ({ key, name: names[key], value: Math.max(0, worker[key]),
                                              colour: `var(${colours[key]})` }));
}
function workers(report) {
  const list = report.workers ?? [], parts = ["useful", "messages", "polling", "runtime", "idle", "other"];
  const sum = Object.fromEntries(parts.map((key) => [key, list.reduce((s, w) => s + w[key], 0)]));
  const shown = 64;
  const several = new Set(list.map((w) => w.rank)).size > 1;
  const rows = [...list].sort((a, b) => a.rank - b.rank || a.thread - b.thread).slice(0, shown);
  document.getElementById("workers").replaceChildren(
    shares(workerParts(sum), time),
    element("div", { class: "workers" }, ...rows.flatMap((w) => {
      const bar = workerParts(w).filter((part) => part.value > 0);
      const total = bar.reduce((s, part) => s + part.value, 0);
      return [element("span", {}, `${several ? `rank ${w.rank} · ` : ""}${w.thread < 1 << 20 ? `thread ${w.thread}` : "without a task"}`),
              stacked(bar, total, time), element("span", { class: "figure" }, percent(w.useful / total))];
    })),
    list.length > shown ? element("p", { class: "soft" }, `${list.length - shown} more workers are not shown.`) : "");
}

function criticalPath(trace, report) {
  const path = report.critical_path;
  const colours = ["--useful", "--path-dt", "--messages", "--path-unseen", "--runtime", "--path-step",
                   "--path-sums", "--path-direct", "--path-between", "--polling", "--other"];
  const kinds = trace.pathKinds.map((name, k) => ({ name, value: path.by_kind[name] ?? 0,
                                                    colour: `var(${colours[k % colours.length]})` }));
  const stages = report.stages.filter((stage) => stage.on_path > 0).sort((a, b) => b.on_path - a.on_path);
  const most = stages[0]?.on_path ?? 1;
  document.getElementById("path").replaceChildren(
    element("p", {}, `All tasks together are ${time(path.work)} of work; those that must follow each other, without any wait, ${
      time(path.longest_chain)}. With any number of workers the run can therefore become at most `,
      element("b", {}, `${number(path.speedup_left)} times`), " faster."),
    element("h3", {}, "What decided when the run ended"), shares(kinds, time),
    element("h3", {}, "Its work, by stage"),
    element("div", { class: "workers" }, ...stages.slice(0, 12).flatMap((stage) => [
      element("span", {}, stage.stage),
      element("div", { class: "bar open" }, element("span", { style: `width:${100 * stage.on_path / most}%;background:var(--useful)` })),
      element("span", { class: "figure" }, time(stage.on_path))])));
}

function exchange(trace, report) {
  const { exchange: e, steps_apart: spread } = report;
  const tile = (name, value, text) => element("div", { class: "tile" }, element("div", { class: "name" }, name),
    element("div", { class: "value" }, value), element("p", {}, text));
  document.getElementById("exchange").replaceChildren(
    ...(trace.run.ranks < 2 ? [] : [
      tile("messages", number(e.messages), `${bytes(e.bytes)} in all, ${bytes(e.messages ? e.bytes / e.messages : 0)} each`),
      tile("on their way", time(e.messages ? e.in_flight / e.messages : 0),
           "on average, from posting to the last look that did not find the message"),
      tile("not looked for", time(e.messages ? e.not_looked_for / e.messages : 0),
           "on average, from there until it was found: it may have come, all threads were busy"),
      tile("idle for messages", time(e.exposed), `of workers, ${
        percent(e.exposed / (report.wall * report.workers.length))} of their time`)]),
    tile("patches apart", `${number(spread.mean)} steps`, `on average; ${count(spread.max, "step")} at most`));
}

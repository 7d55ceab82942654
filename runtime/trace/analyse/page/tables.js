// Tables that are sorted by a click on a column's head.

/** columns: {name, value(row), text(row), help, bar}; texts are sorted as such, numbers by size. */
function sortable(columns, rows, { sortBy = 0, action = null, most = 200 } = {}) {
  let by = sortBy, down = true;
  const body = element("tbody"), head = element("tr");
  const table = element("table", {}, element("thead", {}, head), body);
  const fill = () => {
    const value = columns[by].value;
    const sorted = [...rows].sort((a, b) => {
      const [x, y] = [value(a), value(b)];
      return (down ? -1 : 1) * (typeof x === "string" ? -x.localeCompare(y) : x - y);
    });
    head.replaceChildren(...columns.map((column, c) => element("th",
      { scope: "col", "aria-sort": c === by ? (down ? "descending" : "ascending") : null,
        class: typeof column.value(rows[0] ?? {}) === "string" ? "words" : "" },
      element("button", { type: "button", title: column.help ?? null, click: () => {
        down = c === by ? !down : true;
        by = c;
        fill();
      } }, column.name))));
    const largest = columns.map((column) => (column.bar ? Math.max(...rows.map(column.value)) : 0));
    body.replaceChildren(...sorted.slice(0, most).map((row) => element("tr",
      action ? { class: "does", click: () => action(row) } : {},
      ...columns.map((column, c) => {
        const text = (column.text ?? ((r) => String(column.value(r))))(row);
        const content = action && c === 0
          ? element("button", { type: "button", class: "link" }, text) : element("span", {}, text);
        return element("td", { class: typeof column.value(row) === "string" ? "words" : "" }, content,
          column.bar ? element("div", { class: "cell-bar" }, element("i",
            { style: `width:${largest[c] > 0 ? 100 * column.value(row) / largest[c] : 0}%` })) : null);
      }))));
  };
  fill();
  return element("div", { class: "scroll", tabindex: "0" }, table);
}

function stageTable(report, action) {
  const t = (key) => ({ value: (row) => row[key], text: (row) => time(row[key]) });
  const many = new Set(report.stages.map((row) => row.phase)).size > 1;
  const columns = [
    { name: "stage", value: (row) => row.stage },
    ...(many ? [{ name: "phase", value: (row) => row.phase, text: (row) => row.phase,
                  help: "stages between two exchanges become one task" }] : []),
    { name: "tasks", value: (row) => row.count, text: (row) => number(row.count) },
    { name: "total", ...t("total"), bar: true },
    { name: "share", value: (row) => row.share, text: (row) => percent(row.share), help: "of the time that workers had" },
    { name: "mean", ...t("mean") }, { name: "median", ...t("p50") },
    { name: "95 %", ...t("p95"), help: "95 % of the tasks took less" }, { name: "longest", ...t("max") },
    { name: "ranks", value: (row) => row.imbalance_ranks, text: (row) => number(row.imbalance_ranks), help: "imbalance: the most that one rank had over the mean" },
    { name: "threads", value: (row) => row.imbalance_threads, text: (row) => number(row.imbalance_threads), help: "imbalance: the most that one thread had over the mean" },
    { name: "per particle", value: (row) => row.per_particle, text: (row) => (row.per_particle > 0 ? time(row.per_particle) : "–"), help: "and step" },
    { name: "critical path", ...t("on_path"), help: "time of it on the critical path" },
  ];
  return sortable(columns, report.stages, { sortBy: columns.findIndex((c) => c.name === "total"), action });
}

function waitTable(trace, report, action) {
  const { tasks } = trace;
  const rows = (report.longest_waits ?? []).map((wait, w) => ({ ...wait, place: trace.waitTasks[w] }))
    .map((wait) => ({ ...wait, known: wait.place >= 0 && wait.place < tasks.n }));
  if (rows.length === 0) return element("p", { class: "soft" }, "No task waited.");
  const name = ({ task }) => (task.patch < 0 ? "time step" : `${task.phase} of patch ${task.patch}`);
  return sortable([
    { name: "task", value: name },
    { name: "step", value: (row) => row.task.step },
    { name: "rank", value: (row) => row.task.rank },
    { name: "waited", value: (row) => row.time, text: (row) => time(row.time), bar: true, help: "from when everything but the last input had come" },
    { name: "for", value: (row) => row.for },
  ], rows, { sortBy: 3, most: 30, action: (row) => row.known && action(row.place) });
}

function patchTable(report, action) {
  if (!report.slowest_patches) return element("p", { class: "soft" }, "No patches.");
  return sortable([
    { name: "patch", value: (row) => row.patch, text: (row) => `patch ${row.patch}` },
    { name: "rank", value: (row) => row.rank },
    { name: "total", value: (row) => row.total, text: (row) => time(row.total), bar: true },
    { name: "of the mean", value: (row) => row.over_mean, text: (row) => `${number(row.over_mean)} ×`, help: "its time over the mean of patches" },
    { name: "particles", value: (row) => row.particles, text: (row) => number(row.particles) },
    { name: "cells", value: (row) => row.cells, text: (row) => number(row.cells) },
    { name: "per particle", value: (row) => row.per_particle, text: (row) => (row.per_particle > 0 ? time(row.per_particle) : "–"), help: "and step" },
    { name: "why", value: (row) => row.why },
  ], report.slowest_patches, { sortBy: 2, most: 30, action });
}

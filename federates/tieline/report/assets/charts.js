// Charts: zoom by drag (time in all charts at once), read-out at the pointer, groups in a legend.
"use strict";

(() => {
  const { look } = tieline;
  const shown = new Map();
  const state = { focus: tieline.data.focus, time: null, zoom: null };
  const HEIGHTS = { usual: 270, small: 150 };

  function seriesOf(spec, curve, groups) {
    if (curve.style === "reference") {
      return { label: curve.label, stroke: () => look.css("--ink"), width: 2, dash: [6, 4] };
    }
    const group = groups.find((one) => one.name === curve.group);
    const alone = group.count === 1;
    const series = {
      label: curve.label,
      stroke: group.colour,
      width: alone ? 1.6 : 1,
      dash: alone ? group.dash : [],
      show: group.isShown,
    };
    if (curve.style === "step") series.paths = uPlot.paths.stepped({ align: -1 });
    if (spec.kind === "bars") {
      series.paths = uPlot.paths.bars({ size: [1, 60], gap: 0 });
      series.fill = series.stroke;
    }
    return series;
  }

  function axes(spec) {
    const common = {
      stroke: () => look.css("--ink"),
      grid: { stroke: () => look.css("--grid"), width: 1 },
      ticks: { stroke: () => look.css("--grid"), width: 1, size: 5 },
      font: "12px system-ui, sans-serif",
      labelFont: "12px system-ui, sans-serif",
      labelSize: 20,
    };
    return [
      { ...common, label: spec.x, size: 34 },
      { ...common, label: spec.y, size: 62 },
    ];
  }

  /** Returns what gives the vertical axis its range. */
  function ranger(spec, rows) {
    if (spec.from_zero) return (chart, low, high) => [0, (high || 1) * 1.05];
    const drawn = rows.filter((row, i) => spec.curves[i].style !== "hidden");
    const [least, most] = drawn.flat().reduce(
      ([a, b], value) => (value === null ? [a, b] : [Math.min(a, value), Math.max(b, value)]),
      [Infinity, -Infinity],
    );
    // Zoomed in on a rest, the axis would show the rounding, or fail to tell its own marks apart.
    const narrowest = Math.max((most - least) * 2e-3, Math.abs(most) * 1e-6, 1e-9);
    return (chart, low, high) => {
      if (low === null || !Number.isFinite(low)) return [0, 1];
      const middle = (low + high) / 2;
      const half = Math.max(high - low, narrowest) * 0.55;
      return [middle - half, middle + half];
    };
  }

  function markEvents(chart) {
    const { ctx, bbox } = chart;
    ctx.save();
    ctx.fillStyle = look.css("--soft");
    ctx.lineJoin = "round";
    ctx.textAlign = "left";
    ctx.textBaseline = "alphabetic";
    ctx.font = `${11 * devicePixelRatio}px system-ui, sans-serif`;
    // Words that would run into each other stand on the next line; on the last one they are left out.
    const free = [-Infinity, -Infinity, -Infinity];
    for (const [at, what] of tieline.data.events) {
      const x = Math.round(chart.valToPos(at, "x", true));
      if (x < bbox.left || x > bbox.left + bbox.width) continue;
      ctx.setLineDash([3, 3]);
      ctx.lineWidth = devicePixelRatio;
      ctx.strokeStyle = look.css("--soft");
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
      const line = free.findIndex((end) => x > end);
      if (line < 0) continue;
      const place = [what, x + 4, bbox.top + (11 + 13 * line) * devicePixelRatio];
      ctx.setLineDash([]);
      ctx.strokeStyle = look.css("--paper");
      ctx.lineWidth = 4 * devicePixelRatio;
      ctx.strokeText(...place);
      ctx.fillText(...place);
      free[line] = x + ctx.measureText(what).width + 8;
    }
    ctx.restore();
  }

  function readOut(spec, chart) {
    const { idx, left, top } = chart.cursor;
    const near = chart.series.findIndex((series, i) => i > 0 && series.isNear);
    if (idx === null || idx === undefined || left < 0) return look.tip("");
    const lines = [`${look.number(chart.data[0][idx], 3)} ${spec.x.split(", ").pop()}`];
    spec.curves.forEach((curve, i) => {
      const isNamed = curve.style === "reference" || spec.curves.length <= 8 || i + 1 === near;
      if (!isNamed || !chart.series[i + 1].show || chart.data[i + 1][idx] === null) return;
      const group = curve.group !== curve.label && curve.group !== "units" ? ` (${curve.group})` : "";
      const mark = i + 1 === near && spec.curves.length > 1 ? "> " : "";
      lines.push(`${mark}${curve.label}${group}: ${look.number(chart.data[i + 1][idx])}`);
    });
    if (state.focus && spec.curves.every((c, i) => c.unit !== state.focus || i + 1 !== near)) {
      const value = chart.data[chart.series.length - 1][idx];
      if (hasFocus(spec)) lines.push(`${state.focus}: ${look.number(value)}`);
    }
    const box = chart.over.getBoundingClientRect();
    look.tip(lines.join("\n"), box.left + left, box.top + top);
  }

  const hasFocus = (spec) => spec.curves.some((curve) => curve.unit && curve.unit === state.focus);

  function focusRow(spec, rows) {
    const at = spec.curves.findIndex((curve) => curve.unit && curve.unit === state.focus);
    return at < 0 ? new Array(rows[0].length).fill(null) : rows[at + 1];
  }

  /** Says in the legend which unit stands out. */
  function nameFocus({ spec, host }) {
    const chip = host.querySelector(".chip.strong");
    if (!chip) return;
    chip.hidden = !hasFocus(spec);
    chip.lastChild.textContent = state.focus || "";
  }

  function shareZoom(spec, chart) {
    if (spec.kind !== "time" || chart.status !== 1) return;
    const { min, max } = chart.scales.x;
    // The others call this too, some time later: without this check they would go on for ever.
    if (state.zoom && state.zoom.min === min && state.zoom.max === max) return;
    state.zoom = { min, max };
    for (const other of shown.values()) {
      if (other.chart !== chart && other.spec.kind === "time") other.chart.setScale("x", { min, max });
    }
  }

  function placeMarker(entry) {
    if (!entry.marker) return;
    const { min, max } = entry.chart.scales.x;
    entry.marker.hidden = state.time === null || state.time < min || state.time > max;
    if (!entry.marker.hidden) entry.marker.style.left = `${entry.chart.valToPos(state.time, "x")}px`;
  }

  function optionsOf(spec, rows, groups, width, height) {
    return {
      width,
      height,
      legend: { show: false },
      scales: { x: { time: false }, y: { range: ranger(spec, rows) } },
      axes: axes(spec),
      cursor: { focus: { prox: 30 }, points: { show: spec.curves.length <= 8, size: 7 }, drag: { x: true, y: false } },
      focus: { alpha: 1 },
      series: [
        {},
        ...spec.curves.map((curve) => ({ points: { show: false }, ...seriesOf(spec, curve, groups) })),
        { label: "highlighted", stroke: () => look.css("--strong"), width: 2.2, points: { show: false } },
      ],
      hooks: {
        draw: [(chart) => spec.kind === "time" && markEvents(chart)],
        setSeries: [
          (chart, index) => chart.series.forEach((series, i) => (series.isNear = i === index)),
        ],
        setCursor: [(chart) => readOut(spec, chart)],
        setScale: [
          (chart, key) => {
            if (key !== "x") return;
            shareZoom(spec, chart);
            const entry = shown.get(spec.name);
            if (entry) queueMicrotask(() => placeMarker(entry));
          },
        ],
      },
    };
  }

  async function draw(host) {
    const spec = tieline.data.charts.find((one) => one.name === host.dataset.name);
    const tables = [...new Set(spec.curves.map((curve) => curve.table))];
    const unpacked = await Promise.all(tables.map(tieline.table));
    const rows = spec.curves.map((c) => unpacked[tables.indexOf(c.table)][c.row]);
    const groups = tieline.groupsOf(spec);
    const data = [tieline.axisOf(tables[0]), ...rows];
    const height = HEIGHTS[host.classList.contains("small") ? "small" : "usual"];
    const plot = look.element("div", { className: "plot" });
    const title = look.element("h3", {}, spec.title);
    host.replaceChildren(title);
    host.append(plot);
    const chart = new uPlot(optionsOf(spec, rows, groups, host.clientWidth, height), [...data, focusRow(spec, data)], plot);
    plot.before(tieline.legend(spec, groups, chart));
    plot.setAttribute("role", "img");
    plot.setAttribute("aria-label", `${spec.title}: ${spec.y} against ${spec.x}`);
    if (spec.note) host.append(look.element("p", { className: "note" }, spec.note));
    const entry = { spec, chart, data, host };
    shown.set(spec.name, entry);
    nameFocus(entry);
    if (spec.kind === "time") {
      entry.marker = look.element("div", { className: "marker", hidden: true });
      chart.over.append(entry.marker);
      if (state.zoom) chart.setScale("x", state.zoom);
    }
    new ResizeObserver(() => {
      const width = host.clientWidth;
      if (width && width !== chart.width) chart.setSize({ width, height });
      placeMarker(entry);
    }).observe(host);
    chart.over.addEventListener("mouseleave", () => look.tip(""));
    placeMarker(entry);
    host.dataset.drawn = "yes";
    if (!performance.getEntriesByName("first-plot").length) performance.mark("first-plot");
  }

  look.onTheme(() => shown.forEach((entry) => entry.chart.redraw(false)));

  tieline.charts = {
    state,
    shown,
    draw,
    /** Moves the mark of the replayed instant in every chart of time. */
    setTime(time) {
      state.time = time;
      shown.forEach(placeMarker);
    },
    /** Makes a unit stand out in every chart; null for none. */
    setFocus(unit) {
      state.focus = unit;
      for (const entry of shown.values()) {
        const { spec, chart, data } = entry;
        nameFocus(entry);
        chart.setData([...data, focusRow(spec, data)], false);
        chart.redraw();
      }
    },
  };
})();

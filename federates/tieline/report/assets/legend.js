// The legend of a chart: areas first, in the same order and colour in every chart.
"use strict";

(() => {
  const { look } = tieline;

  /** Returns the groups of a chart's curves, each with its colour and dashes. */
  tieline.groupsOf = (spec) => {
    const drawn = spec.curves.filter((curve) => curve.style !== "reference");
    const { areas } = tieline.data;
    const first = areas.filter((area) => drawn.some((curve) => curve.group === area));
    const names = [...new Set([...first, ...drawn.map((curve) => curve.group)])];
    const all = [...new Set([...(first.length ? areas : []), ...names])];
    return names.map((name) => {
      const own = drawn.filter((curve) => curve.group === name);
      const place = all.indexOf(name);
      return {
        name,
        count: own.length,
        isShown: own.some((curve) => curve.style !== "hidden"),
        colour: () => look.colour(place, all.length),
        dash: first.length || own[0].style === "step" ? [] : look.dash(place, all.length),
      };
    });
  };

  function sample(colour, dash) {
    const line = look.svg("line", { x1: 1, y1: 5, x2: 23, y2: 5, stroke: colour, "stroke-width": 2.5 });
    line.setAttribute("stroke-dasharray", dash.join(" "));
    return look.svg("svg", { width: 24, height: 10, "aria-hidden": "true" }, line);
  }

  /** Returns the legend of a chart, whose chips show and hide groups of curves. */
  tieline.legend = (spec, groups, chart) => {
    const box = look.element("div", { className: "legend" });
    for (const curve of spec.curves.filter((one) => one.style === "reference")) {
      box.append(look.element("span", { className: "chip fixed" }, sample("var(--ink)", [6, 4]), curve.label));
    }
    if (spec.curves.length === 1) return box;
    for (const group of groups) {
      const name = group.name + (group.count > 1 ? ` (${group.count})` : "");
      const chip = look.element("button", { className: "chip", type: "button" });
      chip.append(sample(group.colour(), group.count === 1 ? group.dash : []), name);
      chip.setAttribute("aria-pressed", group.isShown);
      chip.addEventListener("click", () => {
        group.isShown = !group.isShown;
        chip.setAttribute("aria-pressed", group.isShown);
        chart.batch(() => {
          spec.curves.forEach((curve, i) => {
            if (curve.group === group.name) chart.setSeries(i + 1, { show: group.isShown });
          });
        });
      });
      look.onTheme(() => chip.firstChild.firstChild.setAttribute("stroke", group.colour()));
      box.append(chip);
    }
    if (spec.curves.some((curve) => curve.unit)) {
      box.append(look.element("span", { className: "chip fixed strong" }, sample("var(--strong)", []), document.createTextNode("")));
    }
    return box;
  };
})();

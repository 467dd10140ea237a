// Zooming into a drawing with buttons, and moving about in it with the pointer or the arrow keys.
"use strict";

(() => {
  const { look } = tieline;
  const STEP = 1.5;
  const MOST = 12;

  /** Makes an SVG of some size zoomable, with buttons in its parent. */
  tieline.zoomable = (svg, width, height) => {
    const view = { x: width / 2, y: height / 2, scale: 1 };

    function show() {
      const [w, h] = [width / view.scale, height / view.scale];
      view.x = Math.min(Math.max(view.x, w / 2), width - w / 2);
      view.y = Math.min(Math.max(view.y, h / 2), height - h / 2);
      svg.setAttribute("viewBox", [view.x - w / 2, view.y - h / 2, w, h].map((v) => v.toFixed(2)).join(" "));
      svg.style.cursor = view.scale > 1 ? "grab" : "";
      svg.style.touchAction = view.scale > 1 ? "none" : "";
    }

    function zoom(factor) {
      view.scale = factor ? Math.min(Math.max(view.scale * factor, 1), MOST) : 1;
      show();
    }

    function move(dx, dy) {
      view.x += dx / view.scale;
      view.y += dy / view.scale;
      show();
    }

    const bar = look.element("div", { className: "zoom" });
    for (const [sign, words, factor] of [["+", "larger", STEP], ["−", "smaller", 1 / STEP], ["⤢", "whole", 0]]) {
      const button = look.element("button", { type: "button", title: words }, sign);
      button.setAttribute("aria-label", words);
      button.addEventListener("click", () => zoom(factor));
      bar.append(button);
    }
    bar.addEventListener("keydown", (event) => {
      const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
      if (!way) return;
      event.preventDefault();
      move(...way.map((part) => (part * width) / 10));
    });
    svg.parentElement.append(bar);

    let held = null;
    svg.addEventListener("pointerdown", (event) => (held = [event.clientX, event.clientY]));
    addEventListener("pointerup", () => (held = null));
    svg.addEventListener("pointermove", (event) => {
      if (!held || view.scale === 1) return;
      const units = width / svg.getBoundingClientRect().width;
      move((held[0] - event.clientX) * units, (held[1] - event.clientY) * units);
      held = [event.clientX, event.clientY];
    });
    show();
  };
})();

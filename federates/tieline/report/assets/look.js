// Colours, dashes, numbers and small elements: how everything on the page looks.
"use strict";

(() => {
  // Okabe and Ito: told apart by the colour-blind too; the second list is for dark pages.
  const KINDS = [
    ["#0072b2", "#d55e00", "#009e73", "#b0508a", "#a6761d", "#2aa5d8", "#6a51a3", "#666666"],
    ["#56b4e9", "#ff9248", "#35c79b", "#e58fbf", "#e6b800", "#9ad8f5", "#b9a6e8", "#b0b0b0"],
  ];
  const DASHES = [[], [7, 3], [2, 2], [10, 3, 2, 3], [5, 5], [1, 3], [12, 4], [4, 1, 1, 1]];
  const RAMP = ["#440154", "#3b528b", "#21918c", "#5ec962", "#c9b800"];
  const dark = window.matchMedia("(prefers-color-scheme: dark)");

  const look = (tieline.look = {});

  look.onTheme = (act) => dark.addEventListener("change", act);
  look.css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

  /** Returns the colour of one of `count` kinds of curves. */
  look.colour = (i, count) =>
    count <= KINDS[0].length ? KINDS[dark.matches ? 1 : 0][i] : look.mix(RAMP, i / (count - 1));

  look.dash = (i, count) => (count <= DASHES.length ? DASHES[i] : DASHES[i % 3]);

  /** Returns the colour at a place (0 to 1) between evenly spaced stops, each as #rrggbb. */
  look.mix = (stops, place) => {
    const at = Math.min(Math.max(place, 0), 1) * (stops.length - 1);
    const first = Math.min(Math.floor(at), stops.length - 2);
    const parts = [1, 3, 5].map((from) => {
      const [a, b] = [stops[first], stops[first + 1]].map((c) => parseInt(c.slice(from, from + 2), 16));
      return Math.round(a + (b - a) * (at - first));
    });
    return `rgb(${parts.join(",")})`;
  };

  look.scales = {
    deviation: ["#8c3b04", "#d9822b", "#f6e3c5", "#f7f7f7", "#cfe0f2", "#5b9bd5", "#1c4f8f"],
    load: ["#b9c2c9", "#f2c14e", "#ee6c2d", "#b3001b"],
    age: ["#efedf5", "#bcbddc", "#807dba", "#54278f"],
  };

  /** Returns a number with four significant digits, or as many as tell 60.001 from 60.002. */
  look.number = (value, digits) => {
    if (value === null || value === undefined) return "-";
    if (digits !== undefined) return value.toFixed(digits);
    const size = Math.abs(value);
    if (size >= 1000) return value.toFixed(0);
    return value.toFixed(size >= 100 ? 1 : size >= 20 ? 3 : size >= 0.1 || size === 0 ? 4 : 5);
  };

  /** Returns a round number that is not below a value, by at most a third above it. */
  look.nice = (value) => {
    if (!(value > 0)) return 1;
    const power = 10 ** Math.floor(Math.log10(value));
    const size = [1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10].find((m) => m * power >= value * 0.999);
    return Number((size * power).toPrecision(3));
  };

  /** Returns an HTML element with properties and children. */
  look.element = (name, properties = {}, ...children) => {
    const made = document.createElement(name);
    for (const [key, value] of Object.entries(properties)) {
      if (key in made) made[key] = value;
      else made.setAttribute(key, value);
    }
    made.append(...children);
    return made;
  };

  /** Returns an SVG element with attributes and children. */
  look.svg = (name, attributes = {}, ...children) => {
    const made = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    made.append(...children);
    return made;
  };

  const tip = document.getElementById("tip");

  /** Shows words beside a point of the window; without words, nothing. */
  look.tip = (words, x, y) => {
    tip.hidden = !words;
    if (!words) return;
    tip.textContent = words;
    const { offsetWidth: width, offsetHeight: height } = tip;
    tip.style.left = `${Math.max(4, Math.min(x + 14, innerWidth - width - 8))}px`;
    tip.style.top = `${y + 18 + height > innerHeight ? y - height - 10 : y + 18}px`;
  };
})();

// The replay: a slider and a play button that move the drawing, the read-outs and the charts' mark.
"use strict";

(() => {
  const { look } = tieline;
  const TABLES = ["coi", "pmu", "speed", "age", "vbus", "load", "queue", "dropped_so_far"];

  function bar(title, stops, low, high, middle) {
    const gradient = `linear-gradient(to right, ${stops.join(", ")})`;
    const box = look.element("div", { className: "scale" });
    const ends = look.element("div", { className: "ends" }, look.element("span", {}, low));
    if (middle) ends.append(look.element("span", {}, middle));
    ends.append(look.element("span", {}, high));
    const colours = look.element("div", { className: "colours" });
    colours.style.background = gradient;
    box.append(look.element("div", {}, title), colours, ends);
    return box;
  }

  function choice(label, options, onChange) {
    const select = look.element("select");
    options.forEach(([value, words]) => select.append(look.element("option", { value }, words)));
    select.addEventListener("change", () => onChange(select.value));
    return look.element("label", {}, `${label} `, select);
  }

  class Replay {
    constructor(host, facts, curves) {
      this.axis = tieline.axisOf("coi");
      this.isPlaying = false;
      const picture = look.element("div", { className: "picture" });
      this.panel = look.element("div", { className: "panel" });
      this.controls = this.makeControls();
      host.replaceChildren(this.controls, look.element("div", { className: "stage" }, picture, this.panel));
      this.drawing = new tieline.Drawing(picture, facts, curves);
      this.fillPanel(facts, picture);
      this.setTime(tieline.data.begin_s);
    }

    makeControls() {
      const last = this.axis[this.axis.length - 1];
      this.slider = look.element("input", { type: "range", min: 0, max: last, step: 0.05, id: "time" });
      this.slider.setAttribute("aria-label", "instant of the replay, s");
      this.slider.addEventListener("input", () => this.setTime(Number(this.slider.value)));
      this.button = look.element("button", { type: "button", id: "play" }, "▶ Play");
      this.button.addEventListener("click", () => (this.isPlaying ? this.stop() : this.play()));
      const first = tieline.data.events.length ? tieline.data.events[0][0] : 0;
      const back = look.element("button", { type: "button" }, "To the first event");
      back.addEventListener("click", () => this.setTime(Math.max(0, first - 0.5)));
      this.speed = 2;
      const speeds = [[0.25, "¼ of real time"], [0.5, "½"], [1, "real time"], [2, "2 times"], [5, "5 times"]];
      const pace = choice("Speed", speeds, (value) => (this.speed = Number(value)));
      pace.querySelector("select").value = "2";
      this.clock = look.element("output", { id: "clock" });
      return look.element("div", { className: "controls" }, this.button, back, this.slider, this.clock, pace);
    }

    fillPanel(facts, picture) {
      const quantities = [
        ["frequency", "frequency"],
        ["swing", "frequency against the centre of inertia"],
        ...(facts.with_voltages ? [["voltage", "voltage against its start"]] : []),
      ];
      const again = () => {
        this.scales.replaceWith((this.scales = this.makeScales(facts)));
        this.setTime(this.time);
      };
      this.panel.append(choice("Stations:", quantities, (value) => {
        this.drawing.quantity = value;
        again();
      }));
      if (facts.links.length) {
        this.panel.append(choice("Links:", [["load", "load"], ["queue", "longest queue"]], (value) => {
          this.drawing.linkQuantity = value;
          again();
        }));
      }
      const names = look.element("input", { type: "checkbox" });
      names.addEventListener("change", () => picture.classList.toggle("named", names.checked));
      this.panel.append(look.element("label", {}, names, " names of the stations"));
      this.scales = this.makeScales(facts);
      this.now = look.element("dl", { className: "now" });
      this.happened = look.element("p", { className: "happened" });
      const overview = look.element("div", { className: "chart small" });
      overview.dataset.name = "coi";
      this.panel.append(this.scales, this.now, this.happened, overview);
      picture.append(this.key(facts));
      this.overview = overview;
    }

    makeScales(facts) {
      const { ranges, quantity, linkQuantity } = this.drawing;
      const range = ranges[quantity];
      const { deviation, load, age } = look.scales;
      const box = look.element("div", { className: "scales" });
      const signed = (unit) => [`-${range} ${unit}`, `+${range} ${unit}`];
      if (quantity === "frequency") {
        const ends = [facts.nominal_hz - range, facts.nominal_hz + range].map((hz) => `${+hz.toFixed(4)} Hz`);
        box.append(bar("Frequency of a station", deviation, ...ends, `${facts.nominal_hz} Hz`));
      } else if (quantity === "swing") {
        box.append(bar("Against the centre of inertia", deviation, ...signed("Hz"), "0"));
      } else {
        box.append(bar("Voltage against its start", deviation, ...signed("pu"), "0"));
      }
      if (facts.links.length) {
        const unit = linkQuantity === "load" ? "%" : "packets";
        const title = linkQuantity === "load" ? "Load of a link (wider: more)" : "Longest queue of a link (wider: more)";
        box.append(bar(title, load, "0", `${ranges[linkQuantity]} ${unit}`));
      }
      if (facts.units.some((unit) => unit.age)) {
        box.append(bar("Age of a controller's data", age, "0", `${ranges.age} ms`));
      }
      return box;
    }

    key(facts) {
      const signs = [
        ["circle", { cx: 8, cy: 8, r: 6, class: "station pmu" }, "station with a PMU"],
        ["circle", { cx: 8, cy: 8, r: 5, class: "station" }, "without a PMU"],
        ["circle", { cx: 8, cy: 8, r: 5, class: "station unknown" }, "no frequency there"],
        ["rect", { x: 4, y: 4, width: 8, height: 8, class: "unit" }, "unit (click to highlight)"],
      ];
      if (facts.units.some((unit) => unit.tripped_s !== null)) {
        signs.push(["path", { d: "M3 3l10 10m0-10l-10 10", class: "tripped" }, "tripped"]);
      }
      if (facts.nodes.some((node) => node.kind === "control centre")) {
        signs.push(["polygon", { points: "8,2 14,8 8,14 2,8", class: "node control-centre" }, "control centre"]);
      }
      if (facts.links.length) {
        signs.push(["text", { x: 3, y: 13, class: "drop" }, "packets dropped just now"]);
        signs.push(["line", { x1: 1, y1: 8, x2: 15, y2: 8, class: "link down" }, "link down"]);
      }
      const list = look.element("ul", { className: "key" });
      for (const [name, attributes, words] of signs) {
        const sign = look.svg(name, attributes, ...(name === "text" ? ["✕"] : []));
        const svg = look.svg("svg", { width: 16, height: 16, "aria-hidden": "true" }, sign);
        list.append(look.element("li", {}, svg, words));
      }
      return list;
    }

    play() {
      if (this.time >= this.axis[this.axis.length - 1] - 0.05) this.setTime(0);
      this.isPlaying = true;
      this.button.textContent = "❚❚ Pause";
      let before = null;
      const step = (now) => {
        if (!this.isPlaying) return;
        const passed = before === null ? 0 : Math.min(0.2, (now - before) / 1e3);
        before = now;
        this.setTime(this.time + this.speed * passed);
        if (this.time >= this.axis[this.axis.length - 1]) this.stop();
        else requestAnimationFrame(step);
      };
      requestAnimationFrame(step);
    }

    stop() {
      this.isPlaying = false;
      this.button.textContent = "▶ Play";
    }

    /** Shows an instant, s, in the drawing, in words and in the charts. */
    setTime(time) {
      this.time = Math.min(Math.max(time, 0), this.axis[this.axis.length - 1]);
      this.slider.value = this.time;
      this.slider.setAttribute("aria-valuetext", `${this.time.toFixed(2)} s`);
      this.clock.textContent = `${this.time.toFixed(2)} s`;
      this.drawing.show(this.time);
      this.now.replaceChildren(
        ...this.drawing.extremes().map(([name, words]) =>
          look.element("div", {}, look.element("dt", {}, name), look.element("dd", {}, words)),
        ),
      );
      const past = tieline.data.events.filter(([at]) => at <= this.time + 1e-9);
      this.happened.textContent = past.map(([at, what]) => `${at.toFixed(2)} s: ${what}`).join("; ");
      tieline.charts.setTime(this.time);
    }
  }

  tieline.startReplay = async (host, facts) => {
    const names = TABLES.filter((name) => name in tieline.data.tables);
    const rows = await Promise.all(names.map(tieline.table));
    const curves = Object.fromEntries(names.map((name, i) => [name, rows[i]]));
    tieline.replay = new Replay(host, facts, curves);
    performance.mark("drawing");
    return tieline.replay.overview;
  };
})();

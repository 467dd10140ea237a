// The drawing: stations coloured by frequency or voltage, links by load, units by age of data.
"use strict";

(() => {
  const { look } = tieline;
  const APART = 2.6;
  const LASTS_S = 0.35;

  function explain(part, words) {
    part.addEventListener("pointermove", (event) => look.tip(words(), event.clientX, event.clientY));
    part.addEventListener("pointerleave", () => look.tip(""));
  }

  class Drawing {
    constructor(host, facts, curves) {
      Object.assign(this, { facts, curves, time: 0, quantity: "frequency", linkQuantity: "load" });
      this.names = new Map([...facts.stations, ...facts.nodes].map((part) => [part.name, part]));
      this.place = tieline.placer([...this.names.values()]);
      this.rank = new Map(facts.stations.map((station, i) => [station.name, i]));
      this.layers = Object.fromEntries(
        ["lines", "links", "drops", "stations", "units", "texts"].map((name) => [
          name,
          look.svg("g", { class: name }),
        ]),
      );
      this.svg = look.svg("svg", {
        role: "img",
        "aria-label": "the interconnection and its communication network",
      });
      this.svg.style.aspectRatio = `${this.place.width} / ${this.place.height}`;
      this.svg.append(...Object.values(this.layers));
      host.append(this.svg);
      tieline.zoomable(this.svg, this.place.width, this.place.height);
      this.ranges = this.findRanges();
      this.drawLines();
      this.links = facts.links.flatMap((link) => this.drawLink(link));
      this.stations = facts.stations.map((station) => this.drawStation(station));
      facts.nodes.filter((node) => !this.rank.has(node.name)).forEach((node) => this.drawNode(node));
      this.units = this.drawUnits();
    }

    at(name) {
      return this.place.at(this.names.get(name));
    }

    /** Returns the value of a curve `[table, row]` at the replayed instant. */
    value(reference, time = this.time) {
      if (!reference) return null;
      const [table, row] = reference;
      return this.curves[table][row][this.index(table, time)];
    }

    index(table, time) {
      const axis = tieline.axisOf(table);
      const at = tieline.placeOf(axis, time);
      // A window's values stand at its end.
      return tieline.data.tables[table].axis === "window" && axis[at] < time - 1e-9
        ? Math.min(at + 1, axis.length - 1)
        : at;
    }

    findRanges() {
      const most = (rows, from) => {
        let found = 0;
        rows.forEach((row) =>
          row.forEach((value, i) => {
            if (value !== null) found = Math.max(found, Math.abs(value - from(i, row)));
          }),
        );
        return look.nice(found);
      };
      const coi = this.curves.coi[0];
      const rows = this.facts.stations.filter((s) => s.frequency).map((s) => {
        const [table, row] = s.frequency.curve;
        return this.curves[table][row];
      });
      const largest = (table) =>
        (this.curves[table] || []).reduce((high, row) => row.reduce((a, b) => Math.max(a, b ?? 0), high), 0);
      return {
        frequency: most(rows, () => this.facts.nominal_hz),
        swing: most(rows, (i) => coi[i]),
        voltage: this.facts.with_voltages ? most(this.curves.vbus, (i, row) => row[0]) : 1,
        load: 100,
        queue: look.nice(Math.max(1, largest("queue"))),
        age: look.nice(largest("age")),
      };
    }

    drawLines() {
      for (const line of this.facts.lines) {
        const [[x1, y1], [x2, y2]] = [this.at(line.a), this.at(line.b)];
        const width = (line.kv >= 300 ? 1.6 : 0.9) + 0.5 * (line.circuits - 1);
        const part = look.svg("line", { x1, y1, x2, y2, "stroke-width": width });
        const circuits = line.circuits > 1 ? `, ${line.circuits} circuits` : "";
        explain(part, () => `line ${line.a} - ${line.b}: ${line.kv} kV${circuits}, ${line.km.toFixed(0)} km`);
        this.layers.lines.append(part);
      }
    }

    drawLink(link) {
      return link.ways.map((row, way) => {
        const [from, to] = way ? [link.b, link.a] : [link.a, link.b];
        const ends = tieline.beside(this.at(from), this.at(to), APART);
        const part = look.svg("line", { ...ends, class: "link", "stroke-linecap": "round" });
        const drop = look.svg("text", {
          x: (ends.x1 + ends.x2) / 2 + (ends.x1 + ends.x2 - this.at(from)[0] - this.at(to)[0]),
          y: (ends.y1 + ends.y2) / 2 + (ends.y1 + ends.y2 - this.at(from)[1] - this.at(to)[1]),
          class: "drop",
        }, "✕");
        const shown = { link, row, part, drop, from, to, isDown: false };
        explain(part, () => this.wordsOfLink(shown));
        this.layers.links.append(part);
        this.layers.drops.append(drop);
        return shown;
      });
    }

    drawStation(station) {
      const [cx, cy] = this.at(station.name);
      const hasPmu = station.frequency && station.frequency.curve[0] === "pmu";
      const part = look.svg("circle", { cx, cy, r: hasPmu ? 6.5 : 5, class: hasPmu ? "station pmu" : "station" });
      this.name(station.name, cx, cy);
      const shown = { station, part, row: this.rank.get(station.name) };
      explain(part, () => this.wordsOfStation(shown));
      this.layers.stations.append(part);
      return shown;
    }

    drawNode(node) {
      const [x, y] = this.at(node.name);
      const size = node.kind === "control centre" ? 6 : 4;
      const points = [[x, y - size], [x + size, y], [x, y + size], [x - size, y]].join(" ");
      const part = look.svg("polygon", { points, class: `node ${node.kind.replace(" ", "-")}` });
      this.name(node.name, x, y);
      explain(part, () => `${node.kind} ${node.name}`);
      this.layers.stations.append(part);
    }

    name(words, x, y) {
      this.layers.texts.append(look.svg("text", { x: x + 7, y: y - 6 }, words));
    }

    drawUnits() {
      const { units } = this.facts;
      return units.map((unit) => {
        const own = units.filter((other) => other.station === unit.station);
        const [x, y] = this.at(unit.station);
        const left = x + (own.indexOf(unit) - (own.length - 1) / 2) * 10;
        const part = look.svg("rect", { x: left - 4, y: y + 8, width: 8, height: 8, class: "unit", tabindex: 0 });
        const cross = look.svg("path", { d: `M${left - 5} ${y + 7}l10 10m0-10l-10 10`, class: "tripped" });
        const shown = { unit, part, cross };
        explain(part, () => this.wordsOfUnit(shown));
        const choose = () => tieline.setFocus(unit.name);
        part.addEventListener("click", choose);
        part.addEventListener("keydown", (event) => event.key === "Enter" && choose());
        part.setAttribute("aria-label", `unit ${unit.name}`);
        this.layers.units.append(part, cross);
        return shown;
      });
    }

    wordsOfStation({ station, row }) {
      const lines = [`station ${station.name} (${station.area}), bus ${station.buses.join(", ")}`];
      const hz = station.frequency && this.value(station.frequency.curve);
      if (hz) lines.push(`${look.number(hz)} Hz (${station.frequency.of})`);
      if (this.facts.with_voltages) {
        lines.push(`bus ${station.bus}: ${look.number(this.value(["vbus", row]))} pu`);
      }
      return lines.join("\n");
    }

    wordsOfLink({ link, row, from, to, isDown }) {
      const lines = [`link ${from} to ${to}: ${link.rate_bps / 1e6} Mbit/s, ${(1e3 * link.propagation_s).toFixed(2)} ms`];
      if (isDown) lines.push("down");
      if (row !== null) {
        lines.push(`load ${this.value(["load", row]).toFixed(1)} %, longest queue ${this.value(["queue", row])}`);
        lines.push(`${this.value(["dropped_so_far", row])} packets dropped so far`);
      }
      return lines.join("\n");
    }

    wordsOfUnit({ unit }) {
      const lines = [`unit ${unit.name}: ${look.number(this.value(unit.speed))} Hz`];
      if (unit.tripped_s !== null && this.time >= unit.tripped_s) lines[0] = `unit ${unit.name}: tripped`;
      else if (unit.age) lines.push(`its controller's data is ${look.number(this.value(unit.age), 1)} ms old`);
      else lines.push("no data from PMUs");
      return lines.join("\n");
    }

    /** Draws the state at an instant, s. */
    show(time) {
      this.time = time;
      this.stations.forEach((shown) => this.colourStation(shown));
      this.links.forEach((shown) => this.colourLink(shown));
      for (const { unit, part, cross } of this.units) {
        const isGone = unit.tripped_s !== null && time >= unit.tripped_s;
        const age = isGone ? null : this.value(unit.age);
        part.style.fill = age === null ? "" : look.mix(look.scales.age, age / this.ranges.age);
        cross.style.display = isGone ? "" : "none";
      }
    }

    colourStation({ station, part, row }) {
      const range = this.ranges[this.quantity];
      let off = null;
      if (this.quantity === "voltage") {
        off = this.value(["vbus", row]) - this.curves.vbus[row][0];
      } else if (station.frequency) {
        const hz = this.value(station.frequency.curve);
        const from = this.quantity === "swing" ? this.value(["coi", 0]) : this.facts.nominal_hz;
        off = hz === null ? null : hz - from;
      }
      part.classList.toggle("unknown", off === null);
      part.style.fill = off === null ? "" : look.mix(look.scales.deviation, 0.5 + off / range / 2);
    }

    colourLink(shown) {
      const { link, row, part, drop } = shown;
      shown.isDown = link.outages.reduce((down, [at, isDown]) => (at <= this.time + 1e-9 ? isDown : down), false);
      const value = row === null ? 0 : this.value([this.linkQuantity, row]);
      const place = value / this.ranges[this.linkQuantity];
      part.classList.toggle("down", shown.isDown);
      part.style.stroke = shown.isDown ? "" : look.mix(look.scales.load, place);
      part.style.strokeWidth = shown.isDown ? 1.5 : 1.4 + 2.4 * Math.min(1, place);
      drop.style.display = row !== null && this.droppedLately(row) ? "" : "none";
    }

    droppedLately(row) {
      const before = Math.max(0, this.time - LASTS_S);
      return this.value(["dropped_so_far", row]) > this.value(["dropped_so_far", row], before);
    }

    /** Returns what stands out at the replayed instant, as [name, words]. */
    extremes() {
      const best = (parts, value, isBetter) =>
        parts.reduce((found, part) => {
          const own = value(part);
          return own !== null && (!found || isBetter(own, found.value)) ? { part, value: own } : found;
        }, null);
      const hz = ({ station }) => station.frequency && this.value(station.frequency.curve);
      const inService = this.units.filter(({ unit }) => unit.tripped_s === null || this.time < unit.tripped_s);
      const age = ({ unit }) => this.value(unit.age);
      const used = this.links.filter(({ row }) => row !== null);
      const low = best(this.stations, hz, (a, b) => a < b);
      const high = best(this.stations, hz, (a, b) => a > b);
      const old = best(inService, age, (a, b) => a > b);
      const busy = best(used, ({ row }) => this.value(["load", row]), (a, b) => a > b);
      const queue = best(used, ({ row }) => this.value(["queue", row]), (a, b) => a > b);
      const dropped = used.reduce((sum, { row }) => sum + this.value(["dropped_so_far", row]), 0);
      const lines = [["System frequency", `${look.number(this.value(["coi", 0]))} Hz`]];
      if (low) lines.push(["Lowest", `${look.number(low.value)} Hz, ${low.part.station.name}`]);
      if (high) lines.push(["Highest", `${look.number(high.value)} Hz, ${high.part.station.name}`]);
      if (old) lines.push(["Oldest data", `${old.value.toFixed(0)} ms, ${old.part.unit.name}`]);
      if (busy) lines.push(["Busiest link", `${busy.value.toFixed(0)} %, ${busy.part.from} to ${busy.part.to}`]);
      if (queue) {
        const where = queue.value ? `, ${queue.part.from} to ${queue.part.to}` : "";
        lines.push(["Longest queue", `${queue.value} packets${where}`]);
      }
      if (used.length) lines.push(["Dropped so far", `${dropped} packets`]);
      return lines;
    }
  }

  tieline.Drawing = Drawing;
})();

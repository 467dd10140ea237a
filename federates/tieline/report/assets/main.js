// Starts everything: the drawing at once, each chart when it comes near the window.
"use strict";

(() => {
  const { look } = tieline;
  const hosts = [...document.querySelectorAll(".chart")];

  function fail(host, error) {
    host.replaceChildren(look.element("p", { className: "warning" }, `This could not be drawn: ${error.message}`));
    throw error;
  }

  function drawOnce(host) {
    if (host.dataset.begun) return Promise.resolve();
    host.dataset.begun = "yes";
    return tieline.charts.draw(host).catch((error) => fail(host, error));
  }

  /** Draws every chart, also those that nobody has scrolled to. */
  tieline.drawAll = () => Promise.all(hosts.map(drawOnce));

  function offerHighlight() {
    const units = [...new Set(tieline.data.charts.flatMap((c) => c.curves.map((one) => one.unit)))].filter(Boolean);
    const section = document.getElementById("curves");
    if (!units.length || !section) return;
    const select = look.element("select", { id: "highlight" });
    select.append(look.element("option", { value: "" }, "none"));
    units.forEach((unit) => select.append(look.element("option", { value: unit }, unit)));
    select.value = tieline.data.focus || "";
    select.addEventListener("change", () => tieline.setFocus(select.value || null));
    const label = look.element("label", { className: "highlight" }, "Highlight unit ", select);
    section.querySelector("h2").after(label);
  }

  /** Makes a unit stand out in charts and drawing. */
  tieline.setFocus = (unit) => {
    const select = document.getElementById("highlight");
    if (select) select.value = unit || "";
    tieline.charts.setFocus(unit);
    if (!tieline.replay) return;
    for (const shown of tieline.replay.drawing.units) {
      shown.part.classList.toggle("focus", shown.unit.name === unit);
    }
  };

  async function start() {
    offerHighlight();
    const stage = document.querySelector(".drawing");
    if (stage) {
      const started = tieline.startReplay(stage, tieline.data.drawing);
      await drawOnce(await started.catch((error) => fail(stage, error)));
    }
    tieline.setFocus(tieline.data.focus);
    const seen = new IntersectionObserver(
      (entries) => entries.filter((e) => e.isIntersecting).forEach((e) => drawOnce(e.target)),
      { rootMargin: "400px" },
    );
    hosts.forEach((host) => seen.observe(host));
    addEventListener("beforeprint", tieline.drawAll);
    document.documentElement.dataset.ready = "yes";
  }

  start();
})();

// Where the parts of the drawing stand on the page.
"use strict";

(() => {
  const BOX = { width: 760, height: 680, margin: 34 };
  // Places are no geography, or seldom need be exact: the shorter side may be drawn out.
  const STRETCH = 2;
  const NEAREST = 30;
  const MOST_TO_SPREAD = 400;

  /** Returns the size of a drawing of parts with `x`, `y` and `name`, and where each stands in it. */
  tieline.placer = (parts) => {
    const xs = parts.map((part) => part.x);
    const ys = parts.map((part) => part.y);
    const [left, right, low, high] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
    const across = (BOX.width - 2 * BOX.margin) / Math.max(right - left, 1e-9);
    const down = (BOX.height - 2 * BOX.margin) / Math.max(high - low, 1e-9);
    const most = STRETCH * Math.min(across, down);
    const points = parts.map((part) => [
      (part.x - left) * Math.min(across, most),
      (high - part.y) * Math.min(down, most),
    ]);
    if (points.length <= MOST_TO_SPREAD) spread(points);
    const [x0, y0] = [0, 1].map((i) => Math.min(...points.map((point) => point[i])));
    const [x1, y1] = [0, 1].map((i) => Math.max(...points.map((point) => point[i])));
    const height = Math.max(y1 - y0 + 2 * BOX.margin, 170);
    const above = (height - (y1 - y0)) / 2;
    const places = new Map(
      parts.map((part, i) => [part.name, [points[i][0] - x0 + BOX.margin, points[i][1] - y0 + above]]),
    );
    return { width: x1 - x0 + 2 * BOX.margin, height, at: (part) => places.get(part.name) };
  };

  /** Moves points apart that would cover each other. */
  function spread(points) {
    for (let turn = 0; turn < 80; turn++) {
      for (let i = 0; i < points.length; i++) {
        for (let j = 0; j < i; j++) {
          const [dx, dy] = [points[i][0] - points[j][0] || 0.01, points[i][1] - points[j][1]];
          const apart = Math.hypot(dx, dy);
          if (apart >= NEAREST) continue;
          const push = (NEAREST - apart) / apart / 4;
          points[i][0] += dx * push;
          points[i][1] += dy * push;
          points[j][0] -= dx * push;
          points[j][1] -= dy * push;
        }
      }
    }
  }

  /** Returns the ends of a line beside the one from a to b, on its right-hand side. */
  tieline.beside = ([ax, ay], [bx, by], apart) => {
    const length = Math.hypot(bx - ax, by - ay) || 1;
    const [nx, ny] = [(-(by - ay) / length) * apart, ((bx - ax) / length) * apart];
    return { x1: ax + nx, y1: ay + ny, x2: bx + nx, y2: by + ny };
  };
})();

// The page's data. Curves come compressed (packing.py) and are unpacked when something shows them.
"use strict";

const tieline = {
  data: JSON.parse(document.getElementById("data").textContent),
  MISSING: 65535,
};

(() => {
  const unpacked = new Map();

  async function inflated(text) {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  }

  async function unpack(table) {
    const bytes = await inflated(table.data);
    const { rows, length, low, step } = table;
    const curves = [];
    for (let row = 0; row < rows; row++) {
      const values = new Array(length);
      let code = 0;
      for (let i = 0, at = row * length; i < length; i++, at++) {
        code = (code + bytes[at] + 256 * bytes[rows * length + at]) & 0xffff;
        values[i] = code === tieline.MISSING ? null : low[row] + step[row] * code;
      }
      curves.push(values);
    }
    return curves;
  }

  /** Returns a promise of the curves of a table, each an array with null where nothing is. */
  tieline.table = (name) => {
    if (!unpacked.has(name)) unpacked.set(name, unpack(tieline.data.tables[name]));
    return unpacked.get(name);
  };

  /** Returns the instants of a table's curves. */
  tieline.axisOf = (name) => tieline.data.axes[tieline.data.tables[name].axis];

  /** Returns the place of the last instant that is not after `at`; 0 if all are. */
  tieline.placeOf = (axis, at) => {
    let low = 0;
    let high = axis.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (axis[middle] <= at + 1e-9) low = middle;
      else high = middle - 1;
    }
    return low;
  };
})();

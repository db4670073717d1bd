// Lines of one value over an even grid that repeats, by marching triangles.

// Pieces [x0, y0, x1, y1] of the line of a level; values (n x n) are at -pi + 2 pi k / n.
export function contour(values, n, level) {
  const at = (i, j) => [2 * Math.PI * (i / n - 0.5), 2 * Math.PI * (j / n - 0.5), values[(i % n) * n + (j % n)]];
  const pieces = [];
  for (let i = 0; i < n; i++) {
    for (let j = 0; j < n; j++) {
      const corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
      const middle = [0, 1, 2].map((d) => corners.reduce((sum, corner) => sum + corner[d] / 4, 0));
      for (let k = 0; k < 4; k++) {
        const three = [corners[k], corners[(k + 1) % 4], middle];
        const ends = [];
        three.forEach((a, s) => {
          const b = three[(s + 1) % 3];
          if ((a[2] < level) === (b[2] < level)) return;
          const part = (level - a[2]) / (b[2] - a[2]);
          ends.push(a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1]));
        });
        if (ends.length === 4) pieces.push(ends);
      }
    }
  }
  return pieces;
}

// Round numbers strictly between two, about `count` of them.
export function levels(low, high, count) {
  const rough = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((digit) => digit * power).find((size) => size >= rough);
  const first = Math.floor(low / step) + 1;
  return Array.from({ length: Math.max(0, Math.ceil(high / step) - first) }, (_, k) => (first + k) * step);
}

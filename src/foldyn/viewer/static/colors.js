// Colors of creases, curves and values; the same as in figures (foldyn.plots.style).

export const KINDS = [ // in the order of sheet.KINDS; bars are the page's own
  { name: "mountain crease", light: "#d55e00", dark: "#f0803c", width: 2.4, dash: [] },
  { name: "valley crease", light: "#0072b2", dark: "#4fb0e8", width: 2.4, dash: [7, 3.5] },
  { name: "flat crease", light: "#767676", dark: "#9a9a9a", width: 1.8, dash: [2, 2.5] },
  { name: "unassigned crease", light: "#b8578e", dark: "#e0a0c4", width: 2, dash: [6, 2.5, 1.5, 2.5] },
  { name: "boundary", light: "#1a1a1a", dark: "#d8d8d8", width: 1.5, dash: [] },
  { name: "bar", light: "#767676", dark: "#9a9a9a", width: 1, dash: [] },
];
export const BOUNDARY = 4;
export const BAR = 5;
export const HIDDEN = 0.3; // opacity of what lies behind a panel

export const CURVES = {
  light: ["#0072b2", "#d55e00", "#009e73", "#b8578e", "#1a1a1a", "#b77f00", "#2f93cf", "#767676"],
  dark: ["#4fb0e8", "#f0803c", "#2fc79a", "#e0a0c4", "#e4e4e4", "#f0b93a", "#8ccbf2", "#9a9a9a"],
};
export const DASHES = [[], [7, 3], [2, 2], [8, 3, 2, 3], [4, 2]];

export const LOOKS = {
  light: {
    background: "#ffffff", front: "#f2dfb8", back: "#d9c39a", ghost: "#c9c9c9", ink: "#1a1a1a",
    grid: "#e4e4e4", support: "#009e73", load: "#8f3f70", selected: "#0072b2",
  },
  dark: {
    background: "#15181c", front: "#d9c59a", back: "#a8946c", ghost: "#4a5056", ink: "#e8e8e8",
    grid: "#33393f", support: "#2fc79a", load: "#e0a0c4", selected: "#4fb0e8",
  },
};

export const STOPS = {
  sequential: ["#fdf6e3", "#f6dca0", "#f2b95f", "#e58c3c", "#cc5d38", "#a3363f", "#6f1d44", "#3a0f3a"],
  diverging: ["#053f73", "#2a78b5", "#7fb5db", "#cfe3f0", "#f7f4ee", "#f7cfae", "#e8945a", "#c4501a", "#7d2a05"],
};

export const rgb = (hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16));

// 256 colors, four bytes each.
export function ramp(name) {
  const stops = STOPS[name].map(rgb);
  const out = new Uint8Array(1024);
  for (let k = 0; k < 256; k++) {
    const place = (k / 255) * (stops.length - 1);
    const i = Math.min(stops.length - 2, Math.floor(place));
    for (let c = 0; c < 3; c++) {
      out[4 * k + c] = Math.round(stops[i][c] + (place - i) * (stops[i + 1][c] - stops[i][c]));
    }
    out[4 * k + 3] = 255;
  }
  return out;
}

export const gradient = (name) => `linear-gradient(to right, ${STOPS[name].join(", ")})`;

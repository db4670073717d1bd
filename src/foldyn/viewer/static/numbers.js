// Numbers and units as people read them, and spectra.

const PREFIXES = [
  [1e9, "G"], [1e6, "M"], [1e3, "k"], [1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"], [1e-12, "p"],
];
const SUPERSCRIPT = "⁻⁰¹²³⁴⁵⁶⁷⁸⁹";

// Factor and unit in which values up to `top` are easily read: (0.069, "m") gives [1000, "mm"].
export function readable(top, unit) {
  if (unit === "1") {
    const power = top > 0 ? 3 * Math.floor(Math.log10(top)/3) : 0;
    if (power === 0 || power === -3) return [1, ""];
    const text = [...String(power)].map((c) => SUPERSCRIPT["-0123456789".indexOf(c)]).join("");
    return [10 ** -power, `×10${text}`];
  }
  if (!/^(m|N|J|W|Pa|m\/s|N m|J\/m²|m\/N|m\/s²)$/.test(unit)) return [1, unit];
  const [size, letter] = PREFIXES.find(([size]) => top >= size * 0.999) ?? [1, ""];
  return [1 / size, letter + unit];
}

export function number(value, digits = 3) {
  if (!Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  const text = size >= 1e5 || size < 1e-3
    ? value.toExponential(digits - 1)
    : String(Number(value.toPrecision(digits)));
  return text.replace("-", "−");
}

// "displacement (mm)": what stands at an axis.
export const titled = (name, unit) => (unit ? `${name} (${unit})` : name);

// Amplitudes of evenly spaced values at frequencies up to Nyquist's, with a Hann window. A sine of
// amplitude a has a peak of a.
export function spectrum(values, dt) {
  const count = values.length;
  const mean = values.reduce((a, b) => a + b, 0) / count;
  const size = 2 ** Math.ceil(Math.log2(4 * count));
  const re = new Float64Array(size);
  const im = new Float64Array(size);
  for (let k = 0; k < count; k++) {
    const window = 1 - Math.cos((2 * Math.PI * k) / (count - 1));
    re[k] = ((values[k] - mean) * window * 2) / count;
  }
  transform(re, im);
  const half = size / 2 + 1;
  return [
    Float64Array.from({ length: half }, (_, k) => k / (size * dt)),
    Float64Array.from({ length: half }, (_, k) => Math.hypot(re[k], im[k])),
  ];
}

// Fourier transform in place; the length is a power of two.
function transform(re, im) {
  const n = re.length;
  for (let i = 1, j = 0; i < n; i++) {
    let bit = n >> 1;
    for (; j & bit; bit >>= 1) j ^= bit;
    j ^= bit;
    if (i < j) {
      [re[i], re[j]] = [re[j], re[i]];
      [im[i], im[j]] = [im[j], im[i]];
    }
  }
  for (let span = 2; span <= n; span *= 2) {
    const angle = (-2 * Math.PI) / span;
    for (let k = 0; k < span / 2; k++) {
      const c = Math.cos(angle * k);
      const s = Math.sin(angle * k);
      for (let i = k; i < n; i += span) {
        const j = i + span / 2;
        const x = re[j] * c - im[j] * s;
        const y = re[j] * s + im[j] * c;
        re[j] = re[i] - x;
        im[j] = im[i] - y;
        re[i] += x;
        im[i] += y;
      }
    }
  }
}

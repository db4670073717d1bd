// Draws sheets with WebGL2. Positions of all nodes, with a level each, are one texture of floats that
// is filled anew for every picture; panels and lines look their nodes up in it.
import { BAR, BOUNDARY, HIDDEN, KINDS, ramp, rgb } from "./colors.js";

const ROW = 1024; // texels

const COMMON = `#version 300 es
precision highp float; precision highp int; precision highp sampler2D;
uniform sampler2D nodes, levels;
uniform vec3 right, up, toward, center;
uniform vec3 scale;  // clip units per meter to the right, up and in depth
uniform vec2 pan;
vec4 node(uint k) { return texelFetch(nodes, ivec2(k % ${ROW}u, k / ${ROW}u), 0); }
float levelOf(uint k) { return texelFetch(levels, ivec2(k % ${ROW}u, k / ${ROW}u), 0).r; }
vec4 seen(vec3 p) {
  p -= center;
  vec3 s = vec3(dot(p, right) - pan.x, dot(p, up) - pan.y, -dot(p, toward));
  return vec4(s * scale, 1.0);
}`;

const PANEL_VERTEX = `${COMMON}
layout(location = 0) in uint corner;
layout(location = 1) in uint panel;
uniform int on;  // 0 paper, 1 levels of nodes, 2 of panels
out vec3 place; out float level;
void main() {
  vec4 p = node(corner);
  place = p.xyz;
  level = on == 1 ? p.w : on == 2 ? levelOf(panel) : 0.0;
  gl_Position = seen(p.xyz);
}`;

const PANEL_FRAGMENT = `#version 300 es
precision highp float; precision highp int;
in vec3 place; in float level; out vec4 color;
uniform int on; uniform vec3 front, back, light, toward; uniform float alpha;
uniform sampler2D colormap;
void main() {
  vec3 normal = normalize(cross(dFdx(place), dFdy(place)));
  float bright = 0.62 + 0.32 * abs(dot(normal, light)) + 0.1 * abs(dot(normal, toward));
  vec3 base = gl_FrontFacing ? front : back;
  if (on > 0) {
    base = texture(colormap, vec2(clamp(level, 0.0, 1.0) * 0.996 + 0.002, 0.5)).rgb;
    bright = 0.4 + 0.6 * bright;
  }
  color = vec4(base * bright, alpha);
}`;

const LINE_VERTEX = `${COMMON}
layout(location = 0) in uvec2 ends;
layout(location = 1) in uint kind;
layout(location = 2) in vec2 along;
layout(location = 3) in uint element;
uniform vec2 pixels;  // half the view
uniform float widths[6]; uniform bool told; uniform float nearer;
flat out uint k; flat out float level, width; out float s, across;
void main() {
  float t = float(gl_VertexID & 1), side = float(gl_VertexID >> 1) * 2.0 - 1.0;
  vec4 a = seen(node(ends.x).xyz), b = seen(node(ends.y).xyz);
  vec2 d = (b.xy - a.xy) * pixels;
  float l = length(d);
  d = l > 1e-4 ? d / l : vec2(1.0, 0.0);
  k = kind;
  level = told && kind != ${BOUNDARY}u ? levelOf(element) : -1.0;
  width = widths[kind];
  if (level >= 0.0) width = max(width, 1.5 + 4.0 * abs(level - 0.5) * width);
  float reach = 0.5 * width + 0.7;
  across = side * reach;
  s = mix(along.x, along.y, t);
  gl_Position = mix(a, b, t);
  gl_Position.xy += (vec2(-d.y, d.x) * across + d * (2.0 * t - 1.0) * 0.3 * width) / pixels;
  gl_Position.z -= nearer;
}`;

const LINE_FRAGMENT = `#version 300 es
precision highp float; precision highp int;
flat in uint k; flat in float level, width; in float s, across; out vec4 color;
uniform vec3 colors[6]; uniform float drawn[6]; uniform float alpha, period;
uniform sampler2D colormap;
void main() {
  float cover = clamp(0.5 * width + 0.5 - abs(across), 0.0, 1.0);
  vec3 tone = colors[k];
  if (level >= 0.0) tone = texture(colormap, vec2(clamp(level, 0.0, 1.0) * 0.996 + 0.002, 0.5)).rgb;
  else if (drawn[k] < 1.0) {
    float blur = fwidth(s) / period, place = abs(fract(s / period) - 0.5) * 2.0;
    cover *= blur > 0.35 ? drawn[k] : clamp((drawn[k] - place) / max(2.0 * blur, 1e-6) + 0.5, 0.0, 1.0);
  }
  if (alpha * cover < 0.01) discard;
  color = vec4(tone, alpha * cover);
}`;

const unit = (hex) => rgb(hex).map((value) => value / 255);
const solid = ({ dash }) => {
  const total = dash.reduce((a, b) => a + b, 0);
  return total ? dash.filter((_, k) => k % 2 === 0).reduce((a, b) => a + b, 0) / total : 1;
};
const DRAWN = KINDS.map(solid); // part of a dashed line that is drawn


export class GLPainter {
  constructor(canvas) {
    const gl = canvas.getContext("webgl2", { antialias: true });
    if (!gl) throw new Error("the browser has no WebGL2");
    this.gl = gl;
    this.canvas = canvas;
    this.panels = this.program(PANEL_VERTEX, PANEL_FRAGMENT);
    this.lines = this.program(LINE_VERTEX, LINE_FRAGMENT);
    this.maps = {};
    for (const name of ["sequential", "diverging"]) {
      this.maps[name] = this.texture();
      const size = [gl.RGBA8, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE];
      gl.texImage2D(gl.TEXTURE_2D, 0, ...size, ramp(name));
    }
    this.scratch = { nodes: this.texture(), levels: this.texture(), rows: {} };
  }

  program(vertex, fragment) {
    const { gl } = this;
    const program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) {
        throw new Error(gl.getShaderInfoLog(shader) || "a shader does not compile");
      }
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
      throw new Error(gl.getProgramInfoLog(program) || "shaders do not link");
    }
    const at = {};
    for (let k = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS) - 1; k >= 0; k--) {
      const { name } = gl.getActiveUniform(program, k);
      at[name.replace("[0]", "")] = gl.getUniformLocation(program, name);
    }
    return { program, at };
  }

  texture() {
    const { gl } = this;
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    for (const key of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) {
      gl.texParameteri(gl.TEXTURE_2D, key, gl.NEAREST);
    }
    for (const key of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) {
      gl.texParameteri(gl.TEXTURE_2D, key, gl.CLAMP_TO_EDGE);
    }
    return texture;
  }

  // Buffers of a sheet at rest: what does not change from picture to picture.
  sheet(sheet) {
    const { gl } = this;
    const buffers = [];
    const filled = (location, array, size, divisor) => {
      const buffer = gl.createBuffer();
      buffers.push(buffer);
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, array, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(location);
      if (array instanceof Float32Array) {
        gl.vertexAttribPointer(location, size, gl.FLOAT, false, 0, 0);
      } else gl.vertexAttribIPointer(location, size, gl.UNSIGNED_INT, 0, 0);
      gl.vertexAttribDivisor(location, divisor);
    };
    const arrays = (fill) => {
      const vao = gl.createVertexArray();
      gl.bindVertexArray(vao);
      fill();
      return vao;
    };
    const lines = (ends, kind, along, element) => ({
      vao: arrays(() => {
        filled(0, ends, 2, 1);
        filled(1, kind, 1, 1);
        filled(2, along, 2, 1);
        filled(3, element, 1, 1);
      }),
      count: ends.length / 2,
    });
    const panel = Uint32Array.from(sheet.triangles, (_, k) => sheet.panel[Math.floor(k / 3)]);
    const made = {
      panels: {
        vao: arrays(() => {
          filled(0, sheet.triangles, 1, 0);
          filled(1, panel, 1, 0);
        }),
        count: sheet.triangles.length,
      },
      edges: lines(sheet.edges, Uint32Array.from(sheet.kind), sheet.along, sheet.crease),
    };
    if (sheet.bars) {
      const count = sheet.bars.length / 2;
      const numbers = Uint32Array.from({ length: count }, (_, k) => k);
      const kind = new Uint32Array(count).fill(BAR);
      made.bars = lines(sheet.bars, kind, new Float32Array(2 * count), numbers);
    }
    gl.bindVertexArray(null);
    made.free = () => {
      for (const part of [made.panels, made.edges, made.bars]) {
        if (part) gl.deleteVertexArray(part.vao);
      }
      buffers.forEach((buffer) => gl.deleteBuffer(buffer));
    };
    return made;
  }

  begin(background) {
    const { gl, canvas } = this;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(...unit(background), 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  }

  // Draw one sheet, `made` by `sheet`, with nodes at `positions` (3n), into a part of the canvas in
  // pixels of the page, y down. `shown` has "on" ("node", "panel", "crease", "bar") and "levels"
  // from 0 to 1, or is null.
  draw(made, positions, shown, view, camera, look) {
    const { gl } = this;
    const { dpr } = look;
    this.fill("nodes", this.placed(positions, shown?.on === "node" ? shown.levels : null), 4);
    if (shown && shown.on !== "node") this.fill("levels", this.rowed(shown.levels), 1);
    const height = view.height * dpr;
    gl.viewport(view.x * dpr, this.canvas.height - view.y * dpr - height, view.width * dpr, height);
    const [right, up, toward] = camera.basis;
    const half = camera.extent(view.width / view.height);
    const light = [0, 1, 2].map((k) => -0.35 * right[k] + 0.62 * up[k] + 0.7 * toward[k]);
    const use = ({ program, at }) => {
      gl.useProgram(program);
      gl.uniform3fv(at.right, right);
      gl.uniform3fv(at.up, up);
      gl.uniform3fv(at.toward, toward);
      gl.uniform3fv(at.center, camera.center);
      gl.uniform3f(at.scale, view.height / view.width / half, 1 / half, 0.25 / camera.size);
      gl.uniform2fv(at.pan, camera.pan);
      const map = this.maps[look.map ?? "sequential"];
      const textures = [["nodes", this.scratch.nodes], ["levels", this.scratch.levels], ["colormap", map]];
      textures.forEach(([name, texture], k) => {
        gl.activeTexture(gl.TEXTURE0 + k);
        gl.bindTexture(gl.TEXTURE_2D, texture);
        gl.uniform1i(at[name], k);
      });
      return at;
    };

    let at = use(this.panels);
    gl.uniform1i(at.on, shown ? { node: 1, panel: 2 }[shown.on] ?? 0 : 0);
    gl.uniform3fv(at.light, light);
    gl.uniform3fv(at.front, unit(look.front));
    gl.uniform3fv(at.back, unit(look.back));
    gl.uniform1f(at.alpha, look.alpha);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1.5, 2);
    if (look.alpha < 1) gl.enable(gl.BLEND);
    else gl.disable(gl.BLEND);
    gl.depthMask(look.alpha >= 1);
    gl.bindVertexArray(made.panels.vao);
    gl.drawArrays(gl.TRIANGLES, 0, made.panels.count);
    gl.disable(gl.POLYGON_OFFSET_FILL);

    at = use(this.lines);
    gl.enable(gl.BLEND);
    gl.depthMask(false);
    gl.uniform2f(at.pixels, view.width / 2, view.height / 2);
    gl.uniform1fv(at.widths, look.kinds.map((kind) => kind.width));
    gl.uniform3fv(at.colors, look.kinds.flatMap((kind) => unit(kind.color)));
    gl.uniform1fv(at.drawn, DRAWN);
    gl.uniform1f(at.period, look.period);
    gl.uniform1f(at.nearer, 1e-4);
    const lines = (part, told) => {
      gl.bindVertexArray(part.vao);
      gl.uniform1i(at.told, told ? 1 : 0);
      for (const [visible, alpha] of look.ghost ? [[true, 1]] : [[false, HIDDEN], [true, 1]]) {
        if (visible) gl.enable(gl.DEPTH_TEST);
        else gl.disable(gl.DEPTH_TEST); // what is hidden shines through, faintly
        gl.uniform1f(at.alpha, alpha * look.lines);
        gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, part.count);
      }
      gl.enable(gl.DEPTH_TEST);
    };
    if (made.bars && shown?.on === "bar") lines(made.bars, true);
    lines(made.edges, shown?.on === "crease");
    gl.depthMask(true);
    gl.bindVertexArray(null);
  }

  // Positions with the levels of nodes, in whole rows of a texture.
  placed(positions, levels) {
    const count = positions.length / 3;
    const out = this.room("nodes", 4 * ROW * Math.ceil(count / ROW));
    for (let k = 0; k < count; k++) {
      out.set(positions.subarray(3 * k, 3 * k + 3), 4 * k);
      out[4 * k + 3] = levels ? levels[k] : 0;
    }
    return out;
  }

  rowed(levels) {
    const out = this.room("levels", ROW * Math.max(1, Math.ceil(levels.length / ROW)));
    out.set(levels);
    return out;
  }

  room(name, size) {
    const { scratch } = this;
    const key = `${name}Room`;
    if (scratch[key]?.length !== size) scratch[key] = new Float32Array(size);
    return scratch[key];
  }

  fill(name, array, channels) {
    const { gl, scratch } = this;
    const rows = array.length / channels / ROW;
    const [inner, outer] = channels === 4 ? [gl.RGBA32F, gl.RGBA] : [gl.R32F, gl.RED];
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, scratch[name]);
    if (scratch.rows[name] === rows) {
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, ROW, rows, outer, gl.FLOAT, array);
    } else gl.texImage2D(gl.TEXTURE_2D, 0, inner, ROW, rows, 0, outer, gl.FLOAT, array);
    scratch.rows[name] = rows;
  }
}

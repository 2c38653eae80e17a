// Drawing: draws a surface on a canvas with WebGL 2. Textures store the data of vertices and faces.
// For each corner of a triangle, the shader receives a vertex index and a face index, with which it
// looks up this data. A new time step changes only the texture of values.
import { BLOCK_COLOURS, NO_VALUE, blockColour, valueTable } from "./colours.js";
import { axesOf, matrixOf } from "./camera.js";

const WIDE = 2048; // width in elements of the textures in which lists are stored

const VERTEX = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;
uniform sampler2D places, shares;
uniform usampler2D blocks;
uniform mat4 matrix;
uniform mat3 turned;
uniform int colouredBy; // meaning of the colours: 0 blocks, 1 values of vertices, 2 values of faces
uniform float pointSize;
in uvec2 corner;
out vec3 seen, place, across;
out float share, hasValue;
flat out uint block, edges;
ivec2 listed(uint i) { return ivec2(int(i % ${WIDE}u), int(i / ${WIDE}u)); }
void main() {
  uint face = corner.y & 0x1fffffffu;
  edges = corner.y >> 29;
  place = texelFetch(places, listed(corner.x), 0).xyz;
  seen = turned * place;
  int which = gl_VertexID % 3;
  across = vec3(which == 0, which == 1, which == 2);
  block = texelFetch(blocks, listed(face), 0).x;
  uint valued = colouredBy == 1 ? corner.x : face;
  share = colouredBy == 0 ? 0.0 : texelFetch(shares, listed(valued), 0).x;
  hasValue = share < 0.0 ? 0.0 : 1.0;
  gl_Position = matrix * vec4(place, 1.0);
  gl_PointSize = pointSize;
}`;

const FRAGMENT = `#version 300 es
precision highp float;
precision highp int;
uniform vec3 blockColours[${BLOCK_COLOURS}];
uniform sampler2D table;
uniform vec3 noValue;
uniform int colouredBy;
uniform bool isLit, hasEdges;
uniform vec4 clip; // clip plane: only fragments with dot(clip.xyz, place) <= clip.w are drawn
in vec3 seen, place, across;
in float share, hasValue;
flat in uint block, edges;
out vec4 colour;
const vec3 lamp = vec3(-.398015, .597022, .696526);
void main() {
  // Computed before discard, because derivatives are undefined after a discard.
  vec3 bent = cross(dFdx(seen), dFdy(seen));
  vec3 slope = sqrt(dFdx(across) * dFdx(across) + dFdy(across) * dFdy(across));
  if (dot(clip.xyz, place) > clip.w) discard;
  vec3 shown = blockColours[block];
  if (colouredBy != 0) {
    shown = hasValue < .999 ? noValue
      : texelFetch(table, ivec2(int(clamp(share, 0.0, 1.0) * 255.0 + .5), 0), 0).rgb;
  }
  float light = .78125;
  if (isLit) {
    vec3 normal = dot(bent, bent) > 0.0 ? normalize(bent) : vec3(0, 0, 1);
    float sideways = max(0.0, (normal.z < 0.0 ? -1.0 : 1.0) * dot(normal, lamp));
    float shade = colouredBy == 0 ? .6 : .4;
    light = 1.0 - shade * (1.0 - .6 * abs(normal.z) - .4 * sideways);
    if (hasEdges) {
      // away: distance of the fragment from each side of the triangle. high: height of the triangle
      // above each side. Both are in pixels. The edges of narrow triangles fade, as in the pictures
      // of shm preview.
      vec3 away = across / max(slope, 1e-20), high = 1.0 / max(slope, 1e-20);
      vec3 isEdge = vec3(edges >> 1 & 1u, edges >> 2 & 1u, edges & 1u);
      vec3 dark = isEdge * (1.0 - smoothstep(.5, 1.5, away)) * clamp((high - 4.0) / 4.0, 0.0, 1.0);
      light *= 1.0 - .586 * max(dark.x, max(dark.y, dark.z));
    }
  }
  colour = vec4(shown * light, 1.0);
}`;

function compiled(gl, type, source) {
  const shader = gl.createShader(type);
  gl.shaderSource(shader, source);
  gl.compileShader(shader);
  if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) {
    throw new Error(`the graphics card rejects the shader: ${gl.getShaderInfoLog(shader)}`);
  }
  return shader;
}

/** Returns the format of each texture that stores a list: `parts` is the count of numbers per
 *  element, the other members are the texture unit and the format for WebGL. */
function kindsOf(gl) {
  return {
    places: { unit: 0, parts: 4, internal: gl.RGBA32F, format: gl.RGBA, type: gl.FLOAT,
      Type: Float32Array },
    shares: { unit: 1, parts: 1, internal: gl.R32F, format: gl.RED, type: gl.FLOAT,
      Type: Float32Array },
    blocks: { unit: 2, parts: 1, internal: gl.R8UI, format: gl.RED_INTEGER, type: gl.UNSIGNED_BYTE,
      Type: Uint8Array },
  };
}

export class Drawing {
  /** Throws Error if WebGL 2 is not available. When the graphics context is lost, `lost` is called
   *  with a sentence for the user; when it is restored, with null. */
  constructor(canvas, lost) {
    this.canvas = canvas;
    this.gl = canvas.getContext("webgl2", { antialias: true, alpha: true });
    if (this.gl === null) throw new Error("this browser has no WebGL 2 and cannot draw the mesh");
    this.surface = null;
    this.shares = null;
    this.set = { edges: true, clip: null, camera: null };
    this.wanted = false;
    canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault();
      lost("the graphics card is not available now; the picture reappears when the card is "
        + "available again");
    });
    canvas.addEventListener("webglcontextrestored", () => {
      this.begin();
      if (this.surface !== null) this.show(this.surface);
      if (this.shares !== null) this.colour(this.shares);
      lost(null);
    });
    this.begin();
  }

  begin() {
    const { gl } = this;
    const program = gl.createProgram();
    gl.attachShader(program, compiled(gl, gl.VERTEX_SHADER, VERTEX));
    gl.attachShader(program, compiled(gl, gl.FRAGMENT_SHADER, FRAGMENT));
    gl.bindAttribLocation(program, 0, "corner");
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
      throw new Error(`the graphics card rejects the shader: ${gl.getProgramInfoLog(program)}`);
    }
    gl.useProgram(program);
    this.uniforms = new Proxy({}, { get: (known, name) =>
      (known[name] ??= gl.getUniformLocation(program, name)) });
    this.lists = {};
    this.buffers = {};
    const kinds = kindsOf(gl);
    for (const [name, { unit }] of Object.entries(kinds)) gl.uniform1i(this.uniforms[name], unit);
    gl.uniform1i(this.uniforms.table, 3);
    gl.activeTexture(gl.TEXTURE3);
    this.texture();
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, valueTable());
    const colours = Array.from({ length: BLOCK_COLOURS }, (_, i) => blockColour(i)).flat();
    gl.uniform3fv(this.uniforms.blockColours, colours.map((part) => part / 255));
    gl.uniform3fv(this.uniforms.noValue, NO_VALUE.map((part) => part / 255));
    gl.enable(gl.DEPTH_TEST);
    gl.clearColor(0, 0, 0, 0);
    this.list("shares", new Float32Array(1));
  }

  texture() {
    const { gl } = this;
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) {
      gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
    }
    return texture;
  }

  /** Stores a list in a texture whose rows have WIDE elements. Throws RangeError if the list is too
   *  long. Does nothing while the graphics context is lost, because all lists are stored again when
   *  the context is restored. */
  list(name, values) {
    const { gl } = this;
    if (this.isLost) return;
    const { unit, parts, internal, format, type, Type } = kindsOf(gl)[name];
    const rows = Math.max(Math.ceil(values.length / parts / WIDE), 1);
    if (rows > gl.getParameter(gl.MAX_TEXTURE_SIZE)) {
      throw new RangeError("the surface has more vertices or faces than this graphics card can "
        + "store: choose a segment, or cut the mesh");
    }
    const padded = new Type(rows * WIDE * parts);
    padded.set(values);
    gl.activeTexture(gl.TEXTURE0 + unit);
    if (this.lists[name] !== undefined) gl.deleteTexture(this.lists[name]);
    this.lists[name] = this.texture();
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texImage2D(gl.TEXTURE_2D, 0, internal, WIDE, rows, 0, format, type, padded);
  }

  /** Sets the surface to draw: {places, corners, blocks}. `places` and `corners` come from
   *  placesOf() and cornersOf() in surface.js. `blocks` is a Uint8Array with the index of the block
   *  colour of each face. The arrays are borrowed until the next call. */
  show(surface) {
    const { gl } = this;
    this.surface = surface;
    this.list("places", surface.places);
    this.list("blocks", surface.blocks);
    for (const kind of ["triangles", "lines", "points"]) {
      if (this.buffers[kind] !== undefined) gl.deleteBuffer(this.buffers[kind]);
      this.buffers[kind] = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[kind]);
      gl.bufferData(gl.ARRAY_BUFFER, surface.corners[kind], gl.STATIC_DRAW);
    }
    if (gl.getError() === gl.OUT_OF_MEMORY) {
      throw new RangeError("the graphics card has too little memory for this surface: "
        + "choose a segment, or cut the mesh");
    }
    this.change({});
  }

  /** Sets the values that determine the colours: {shares, ofPoints}, with the scaled values of the
   *  vertices if ofPoints is true, otherwise of the faces. If `shares` is null, colours show the
   *  blocks. */
  colour(shares) {
    this.shares = shares;
    if (shares !== null) this.list("shares", shares.shares);
    this.change({});
  }

  /** Changes some settings, and redraws with the next animation frame. edges: whether edges are
   *  drawn. clip: null, or [x, y, z, most]; only points p, in frame coordinates (surface.js), with
   *  x * p.x + y * p.y + z * p.z <= most are drawn. camera: a camera of camera.js. */
  change(settings) {
    Object.assign(this.set, settings);
    if (this.wanted) return;
    this.wanted = true;
    requestAnimationFrame(() => {
      this.wanted = false;
      this.draw();
    });
  }

  get isLost() {
    return this.gl.isContextLost();
  }
  get aspect() {
    return Math.max(this.canvas.clientWidth, 1) / Math.max(this.canvas.clientHeight, 1);
  }

  draw() {
    const { gl, canvas, surface, set } = this;
    if (this.isLost) return;
    const density = Math.min(globalThis.devicePixelRatio ?? 1, 3);
    const width = Math.max(Math.round(canvas.clientWidth * density), 1);
    const height = Math.max(Math.round(canvas.clientHeight * density), 1);
    if (canvas.width !== width) canvas.width = width;
    if (canvas.height !== height) canvas.height = height;
    gl.viewport(0, 0, width, height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    if (surface === null || set.camera === null) return;
    const { uniforms } = this;
    const { right, up, view } = axesOf(set.camera);
    gl.uniformMatrix4fv(uniforms.matrix, false, matrixOf(set.camera, this.aspect));
    gl.uniformMatrix3fv(uniforms.turned, false,
      [0, 1, 2].flatMap((i) => [right[i], up[i], view[i]]));
    gl.uniform1i(uniforms.colouredBy, this.shares === null ? 0 : this.shares.ofPoints ? 1 : 2);
    gl.uniform1i(uniforms.hasEdges, set.edges ? 1 : 0);
    gl.uniform4fv(uniforms.clip, set.clip ?? [0, 0, 0, 1]);
    gl.uniform1f(uniforms.pointSize, 3 * density);
    gl.enableVertexAttribArray(0);
    const modes = { triangles: gl.TRIANGLES, lines: gl.LINES, points: gl.POINTS };
    for (const [kind, mode] of Object.entries(modes)) {
      const corners = surface.corners[kind].length / 2;
      if (corners === 0) continue;
      gl.uniform1i(uniforms.isLit, kind === "triangles" ? 1 : 0);
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[kind]);
      gl.vertexAttribIPointer(0, 2, gl.UNSIGNED_INT, 0, 0);
      gl.drawArrays(mode, 0, corners);
    }
  }
}

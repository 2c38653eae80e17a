// The page: opens a file, shows its surface with the options that the user chooses, and describes
// the file. The object `state` contains the whole state. Every change of a choice calls look(),
// which reads the data for the latest choices as soon as the current read has ended. Text from a
// file is always inserted as text, never as markup.
import { axesOf, cameraFrom, fitted, SIDES, USUAL_VIEW } from "./camera.js";
import { colourings, nearStep, selection, wantedOf } from "./choices.js";
import { BLOCK_COLOURS, blockColour, valueColour } from "./colours.js";
import { Drawing } from "./drawing.js";
import { element, factsOf, segmentsOf, setsOf } from "./facts.js";
import { bytesText, nameText, plural, valueText } from "./numbers.js";
import { fileInside, opened } from "./opening.js";
import { cameraKey, takePointers } from "./pointing.js";
import { boxOf, cornersOf, frameOf, joined, numbersOf, placesOf, rangeOf, sharesOf, viewOfPlane }
  from "./surface.js";

// size in bytes; if a file on a server is larger, the page at first shows only one of its segments
const LARGE = 64e6;
const MOST_BLOCKS = 1000; // maximum number of blocks that the page lists
// a mesh without faces is drawn as points if it has at most this number of vertices
const MOST_VERTICES = 4e6;

/** The surface of an empty selection. */
const NOTHING = { vertexCount: 0, faceCount: 0, leftOut: 0, points: new Float32Array(0),
  connectivity: new Uint32Array(0), offsets: new Uint32Array(1), blocks: new Uint32Array(0),
  arrays: null };

const $ = (id) => document.getElementById(id);
const state = {
  name: "", archive: null, mesh: null, segments: [], choices: [], opening: 0,
  hidden: new Set(), segment: null, clip: null, choice: null, place: 0, component: null,
  range: null, frame: null, surface: null, camera: cameraFrom(USUAL_VIEW), first: null,
  isFitted: false, isPlaying: false,
};
let drawing = null;

// --- messages

/** Returns true if the decoder or the page itself ran out of memory. */
function isOfMemory(error) {
  return error?.status === "no memory"
    || (error instanceof RangeError
      && /allocation|array length|memory|too large/i.test(error.message));
}

function fail(error, name = state.name) {
  const sentence = String(error?.message ?? error);
  $("error").textContent = nameText(isOfMemory(error) ? `${nameText(name)}: this needs more memory `
    + "than a page can use: choose a segment or fewer blocks, or extract a part of the mesh with "
    + `shm extract (${sentence})` : sentence, 2000);
  $("error").hidden = false;
}

function describe() {
  const { mesh, surface, choice } = state;
  const words = [`${plural(mesh.vertexCount, "vertex", "vertices")}, `
    + `${plural(mesh.cellCount, "cell", "cells")}, `
    + `${plural(mesh.blocks.length, "block", "blocks")}, ${bytesText(mesh.fileBytes)}.`];
  if (surface !== null) {
    words.push(surface.onlyPoints ? `Shown: ${plural(surface.drawn, "vertex", "vertices")}.`
      : `Shown: ${plural(surface.drawn, "face", "faces")}.`);
    if (surface.leftOut > 0) {
      words.push(`${plural(surface.leftOut, "cell", "cells")} not shown: of unknown shape.`);
    }
    if (surface.faceCount > surface.drawn) {
      words.push(`${plural(surface.faceCount - surface.drawn, "face", "faces")} not shown: `
        + "with coordinates that are not finite.");
    }
  }
  if (state.segment !== null) words.push(`Segment ${state.segment} of ${state.segments.length}.`);
  if (state.hidden.size > 0) words.push(`${plural(state.hidden.size, "block", "blocks")} off.`);
  if (state.clip !== null) {
    words.push(`Cut across ${"xyz"[state.clip.axis]} at ${valueText(state.clip.from)}.`);
  }
  if (choice !== null && surface !== null) {
    const step = choice.steps === null ? "" : ` at step ${choice.steps[state.place]}`;
    words.push(state.range === null ? `${nameText(choice.name)}${step} has no finite values.`
      : `Colours: ${nameText(choice.name)}${step}, ${valueText(state.range.least)} to `
        + `${valueText(state.range.greatest)}.`);
  }
  $("summary").replaceChildren(element("strong", nameText(state.name)), " ", words.join(" "));
  $("picture").setAttribute("aria-label", `Picture of the mesh in ${nameText(state.name)}`);
}

function drawLegend() {
  const { choice, range, component } = state;
  const isNew = $("legend").hidden !== (choice === null);
  $("legend").hidden = choice === null;
  if (choice !== null) fillLegend(choice, range, component);
  if (isNew && state.isFitted) fit();
}

function fillLegend(choice, range, component) {
  const part = choice.components === 1 ? "" : component === null ? ", length"
    : `, component ${component + 1}`;
  const step = choice.steps === null ? "" : ` @ ${choice.steps[state.place]}`;
  $("legend-name").textContent = `${nameText(choice.name)}${part}${step}`;
  $("legend-least").textContent = range === null ? "no finite values" : valueText(range.least);
  $("legend-greatest").textContent = range === null ? "" : valueText(range.greatest);
  const bar = $("legend-bar").getContext("2d");
  for (let x = 0; x < 256; ++x) {
    bar.fillStyle = `rgb(${valueColour(range === null ? NaN : x / 255).join(" ")})`;
    bar.fillRect(x, 0, 1, 1);
  }
}

function drawTriad() {
  const { right, up, view } = axesOf(state.camera);
  [...$("triad").children].forEach((axis, i) => {
    const [line, text] = axis.children;
    const place = (part, length) => [length * right[i], -length * up[i]].forEach((coordinate, c) =>
      part.setAttribute(part === line ? ["x2", "y2"][c] : ["x", "y"][c], coordinate.toFixed(1)));
    place(line, 20);
    place(text, 27);
    axis.setAttribute("opacity", view[i] < -0.5 ? "0.5" : "1");
  });
}

// --- the camera

function setCamera(camera) {
  state.camera = camera;
  drawing?.change({ camera });
  drawTriad();
}
function changeCamera(how) {
  state.isFitted = false;
  if (state.surface !== null) setCamera(how(state.camera));
}
function fit() {
  const legend = $("legend").hidden ? 0 : $("legend").offsetHeight + 24;
  const below = Math.min(legend / Math.max($("picture").clientHeight, 1), 0.5);
  changeCamera((camera) =>
    fitted(camera, boxOf(state.surface.bounds), drawing.aspect, below));
  state.isFitted = true;
}

// --- the surface

/** Returns the clip plane in frame coordinates (surface.js). While the user moves the slider, the
 *  graphics card clips the surface at this plane. When the slider stops, the remaining cells are
 *  read again. */
function clipInFrame(clip) {
  if (clip === null) return null;
  const plane = [0, 0, 0, 0];
  plane[clip.axis] = clip.sign;
  plane[3] = clip.sign * (clip.from - state.frame.middle[clip.axis]) / state.frame.half;
  return plane;
}

/** Reads the surface of the chosen part of the mesh, and the values of the chosen array on the
 *  surface. */
async function readSurface(mesh, choice, step) {
  const select = selection({ hidden: state.hidden, clip: state.clip,
    segment: state.segment === null ? null : state.segments[state.segment] }, mesh.blocks.length);
  const parts = choice === null ? [] : choice.parts.map((index) => (step === null ? { index }
    : { index, step }));
  // If all blocks are switched off, there is nothing to read.
  if (select?.blocks?.length === 0) return NOTHING;
  const progress = (done) => { $("progress").value = done; };
  const surface = await mesh.boundary({ arrays: parts, select, subdivide: true, progress });
  if (surface.faceCount > 0) return surface;
  const ofPoints = choice !== null && choice.location === "point" ? parts : [];
  if (mesh.cellCount > 0 && mesh.vertexCount > MOST_VERTICES && select === undefined) {
    throw new Error(`${plural(mesh.vertexCount, "vertex", "vertices")} without faces are too many `
      + "to draw: choose a segment, or cut the mesh");
  }
  const read = await mesh.read({ cells: false, arrays: ofPoints, select, progress });
  const count = read.vertexCount;
  const numbers = Uint32Array.from({ length: count + 1 }, (_, i) => i);
  return { ...surface, onlyPoints: true, vertexCount: count, faceCount: count, points: read.points,
    connectivity: numbers.subarray(0, count), offsets: numbers, blocks: new Uint32Array(count),
    arrays: ofPoints.length > 0 ? read.arrays : null };
}

/** Returns the values of the chosen array on the surface, as one number per vertex or face. Returns
 *  null if no array is chosen or the array has no values. */
function numbersOfChoice({ mesh, choice, component }, surface) {
  if (choice === null || surface.arrays === null || surface.arrays.length === 0) return null;
  const parts = surface.arrays.map(({ values, components, index }) => ({
    numbers: numbersOf(values, components, components === 1 ? null : component),
    blocks: mesh.arrays[index].blocks }));
  return choice.location === "point" ? parts[0].numbers : joined(parts, surface.blocks);
}

function putSurface(read) {
  const bounds = frameOf(read.points);
  const isNew = state.frame === null;
  if (isNew) state.frame = bounds;
  const places = placesOf(state.frame, read.points);
  const corners = cornersOf(read, places);
  const blocks = Uint8Array.from(read.blocks, (block) => block % BLOCK_COLOURS);
  drawing.show({ places, corners, blocks });
  state.surface = { ...read, bounds, drawn: corners.faces };
  if (isNew && state.first === null) {
    state.first = viewOfPlane(bounds) ?? USUAL_VIEW;
    setCamera(cameraFrom(state.first));
  }
  if (isNew) fit();
}

function putColours() {
  const numbers = numbersOfChoice(state, state.surface);
  const range = numbers === null ? null : rangeOf(numbers);
  if (!$("hold").checked || state.range === null) state.range = range;
  const ofPoints = state.choice?.location === "point";
  drawing.colour(state.choice === null ? null : {
    shares: numbers === null ? new Float32Array(1).fill(-1) : sharesOf(numbers, state.range),
    ofPoints });
  if (numbers === null && state.choice !== null) drawing.colour(null);
}

let looking = null; // promise of the current run of look(), or null
let isStale = false; // true if the choices have changed since the most recent read began

/** Shows the mesh with the current choices. Only one read runs at a time. If the choices change
 *  during a read, the mesh is read again afterwards. */
function look() {
  if (state.mesh === null) return Promise.resolve();
  isStale = true;
  looking ??= (async () => {
    try {
      while (isStale && state.mesh !== null) {
        isStale = false;
        await lookOnce(state.mesh, state.choice, state.place);
      }
    } finally {
      looking = null;
      $("progress").hidden = true;
    }
  })();
  return looking;
}

async function lookOnce(mesh, choice, place) {
  $("progress").value = 0;
  $("progress").hidden = false;
  const step = choice === null || choice.steps === null ? null : choice.steps[place];
  const clip = state.clip;
  try {
    const read = await readSurface(mesh, choice, step);
    if (mesh !== state.mesh || choice !== state.choice) return;
    if (!drawing.isLost) $("error").hidden = true;
    putSurface(read);
    // Once the remaining cells have been read, the clip plane no longer cuts them: whole cells are
    // shown, even those that the plane intersects.
    if (state.clip === clip) drawing.change({ clip: null });
    putColours();
    drawLegend();
    describe();
    document.body.dataset.shown = String(Number(document.body.dataset.shown ?? 0) + 1);
  } catch (error) {
    if (mesh !== state.mesh) return;
    stop();
    fail(error);
  }
}

// --- opening

function option(value, text) {
  const made = element("option", text);
  made.value = value;
  return made;
}

async function openFile(source, name, segment = null) {
  stop();
  const mine = ++state.opening;
  $("error").hidden = true;
  $("welcome").hidden = true;
  $("progress").removeAttribute("value");
  $("progress").hidden = false;
  try {
    const file = await opened(source, name);
    if (mine !== state.opening) {
      await file.close?.();
      return;
    }
    state.archive = file.members === undefined ? null : file;
    state.name = name;
    $("member-line").hidden = state.archive === null;
    if (state.archive === null) {
      await showMesh(file, segment, typeof source === "string");
    } else {
      const names = state.archive.members.slice(0, MOST_BLOCKS);
      $("member").replaceChildren(...names.map((one, i) => option(String(i), nameText(one))));
      if (names.length === 0) throw new Error(`${name}: the archive is empty`);
      await openMember(0);
    }
  } catch (error) {
    if (mine !== state.opening) return;
    await forget();
    $("welcome").hidden = false;
    fail(error, name);
  } finally {
    if (looking === null) $("progress").hidden = true;
  }
}

async function openMember(member) {
  const mine = state.opening;
  const { archive } = state;
  const mesh = await archive.open(archive.members[member]);
  if (mine !== state.opening) await mesh.close();
  else await showMesh(mesh, null, false);
}

/** Closes the mesh and clears the page. */
async function forget() {
  const before = state.mesh;
  Object.assign(state, { mesh: null, surface: null, frame: null, first: null, choice: null });
  for (const id of ["controls", "facts-more", "sets-more", "segments-more", "legend"]) {
    $(id).hidden = true;
  }
  $("triad").toggleAttribute("hidden", true);
  $("summary").textContent = "No file is open.";
  const none = new Uint32Array(0);
  drawing.show({ places: new Float32Array(0), blocks: new Uint8Array(0),
    corners: { triangles: none, lines: none, points: none } });
  await before?.close();
}

async function showMesh(mesh, segment, isRemote) {
  const segments = mesh.segmentCount > 1 ? await mesh.segments() : [];
  await forget();
  const isLarge = isRemote && mesh.fileBytes > LARGE && segments.length > 1;
  if (segment !== null && segment >= Math.max(segments.length, 1)) {
    throw new Error(`${state.name}: there is no segment ${segment}; segments are numbered 0 to `
      + `${Math.max(segments.length, 1) - 1}`);
  }
  Object.assign(state, { mesh, segments, choices: colourings(mesh.arrays), hidden: new Set(),
    segment: segments.length === 0 ? null : segment ?? (isLarge ? 0 : null), clip: null,
    choice: null, place: 0, component: null, range: null });
  document.title = `${nameText(state.name)}: a mesh`;
  $("triad").toggleAttribute("hidden", false);
  fillControls();
  await look();
}

function fillControls() {
  const { mesh, segments } = state;
  $("array").replaceChildren(option("", "by block"), ...state.choices.map((choice, i) =>
    option(String(i), `${nameText(choice.name)} (${choice.location})`)));
  $("component").hidden = $("step-line").hidden = $("hold-line").hidden = true;
  $("clip").value = "";
  $("clip-more").hidden = true;
  $("segment-line").hidden = segments.length === 0;
  $("segment").replaceChildren(option("", "all"), ...segments.map((one, i) =>
    option(String(i), `${i}: ${plural(one.cells, "cell", "cells")}, ${bytesText(one.bytes)}`)));
  $("segment").value = state.segment === null ? "" : String(state.segment);
  const listed = mesh.blocks.slice(0, MOST_BLOCKS);
  $("blocks").replaceChildren(...listed.map((block, i) => {
    const box = element("input");
    box.type = "checkbox";
    box.checked = true;
    box.dataset.block = String(i);
    const swatch = element("span");
    swatch.className = "swatch";
    swatch.style.background = `rgb(${blockColour(i).join(" ")})`;
    const name = block.name === "" ? `block ${block.id}` : nameText(block.name);
    return element("label", box, swatch, `${name}: ${plural(block.cells, "cell", "cells")}`);
  }));
  if (mesh.blocks.length > MOST_BLOCKS) {
    $("blocks").append(`and ${plural(mesh.blocks.length - MOST_BLOCKS, "block", "blocks")} more`);
  }
  $("facts").replaceChildren(...factsOf(mesh));
  $("segments").replaceChildren(...segmentsOf(segments));
  for (const id of ["sets", "segments", "facts"]) $(`${id}-more`).open = false;
  $("sets").replaceChildren();
  $("segments-more").hidden = segments.length === 0;
  $("controls").hidden = $("facts-more").hidden = $("sets-more").hidden = false;
}

async function showSets() {
  const { mesh } = state;
  if (!$("sets-more").open || mesh === null || $("sets").hasChildNodes()) return;
  try {
    const sets = await mesh.sets();
    if (mesh === state.mesh) $("sets").replaceChildren(...setsOf(sets));
  } catch (error) {
    if (mesh === state.mesh) fail(error);
  }
}

// --- controls

function showStep() {
  const { choice, mesh, place } = state;
  const steps = choice?.steps ?? null;
  $("step-line").hidden = $("hold-line").hidden = steps === null;
  if (steps === null) return;
  $("step").max = String(Math.max(steps.length - 1, 0));
  $("step").value = String(place);
  const time = mesh.times[steps[place]];
  const text = `${steps[place]}${time === undefined ? "" : `, time ${valueText(time)}`}`;
  $("step-text").textContent = text;
  $("step").setAttribute("aria-valuetext", text);
}

function chooseArray(index) {
  const before = state.choice;
  const choice = index === "" ? null : state.choices[Number(index)];
  // The new array may have values at other steps than the old array. Chooses the latest step of the
  // new array that is not after the step shown before.
  let place = 0;
  if (choice !== null && choice.steps !== null) {
    place = before?.steps ? nearStep(choice.steps, before.steps[state.place])
      : choice.steps.length - 1;
    if (choice.steps.length === 0) return fail(new Error(`${choice.name} has no values`));
  }
  Object.assign(state, { choice, place, component: null, range: null });
  $("array").value = index;
  const components = choice?.components ?? 1;
  $("component").hidden = components === 1;
  const listed = Math.min(components, MOST_BLOCKS);
  $("component").replaceChildren(option("", "length"), ...Array.from({ length: listed }, (_, i) =>
    option(String(i), `component ${i + 1}`)));
  if (choice === null || choice.steps === null) stop();
  showStep();
  return look();
}

function choosePlace(place) {
  const steps = state.choice?.steps;
  if (!steps) return undefined;
  state.place = Math.min(Math.max(place, 0), steps.length - 1);
  showStep();
  return look();
}

function stop() {
  state.isPlaying = false;
  $("play").textContent = "Play";
  $("play").setAttribute("aria-pressed", "false");
}

/** Shows the time steps one after the other, at most four per second. */
async function play() {
  if (state.isPlaying || !state.choice?.steps) return stop();
  state.isPlaying = true;
  $("play").textContent = "Stop";
  $("play").setAttribute("aria-pressed", "true");
  while (state.isPlaying && state.choice?.steps) {
    const { choice, place } = state;
    await Promise.all([choosePlace((place + 1) % choice.steps.length),
      new Promise((resolve) => { setTimeout(resolve, 250); })]);
  }
  return undefined;
}

/** Applies the clip controls. While the slider moves (`isMoving`), the graphics card clips the
 *  surface. When the slider stops, the remaining cells are read. */
function chooseClip(isMoving) {
  if (state.frame === null) return;
  const axis = $("clip").value;
  $("clip-more").hidden = axis === "";
  if (axis === "") {
    state.clip = null;
  } else {
    const { least, most } = state.frame;
    const share = Number($("clip-at").value) / 1000;
    const from = least[axis] * (1 - share) + most[axis] * share;
    state.clip = { axis: Number(axis), from, sign: $("clip-flip").checked ? -1 : 1 };
    $("clip-at").setAttribute("aria-valuetext", `${"xyz"[axis]} = ${valueText(from)}`);
  }
  drawing.change({ clip: clipInFrame(state.clip) });
  if (!isMoving) look();
}

function connectControls() {
  $("file-input").addEventListener("change", ({ target }) => {
    const [file] = target.files;
    if (file) openFile(file, file.name);
    target.value = "";
  });
  $("member").addEventListener("change", ({ target }) => {
    stop();
    openMember(Number(target.value)).catch(fail);
  });
  $("array").addEventListener("change", ({ target }) => chooseArray(target.value));
  $("component").addEventListener("change", ({ target }) => {
    state.component = target.value === "" ? null : Number(target.value);
    state.range = null;
    if (state.surface === null) return;
    putColours();
    drawLegend();
    describe();
  });
  $("step").addEventListener("input", ({ target }) => choosePlace(Number(target.value)));
  $("play").addEventListener("click", play);
  $("hold").addEventListener("change", () => {
    if (state.surface === null) return;
    putColours();
    drawLegend();
    describe();
  });
  $("edges").addEventListener("change", ({ target }) => drawing.change({ edges: target.checked }));
  $("fit").addEventListener("click", fit);
  $("clip").addEventListener("change", () => chooseClip(false));
  $("clip-flip").addEventListener("change", () => chooseClip(false));
  $("clip-at").addEventListener("input", () => chooseClip(true));
  $("clip-at").addEventListener("change", () => chooseClip(false));
  $("segment").addEventListener("change", ({ target }) => {
    state.segment = target.value === "" ? null : Number(target.value);
    // null: the frame coordinates (surface.js) are recomputed for the chosen segment, which may be
    // much smaller than the mesh
    state.frame = null;
    state.clip = null;
    $("clip").value = "";
    $("clip-more").hidden = true;
    drawing.change({ clip: null });
    look();
  });
  $("blocks").addEventListener("change", ({ target }) => {
    const block = Number(target.dataset.block);
    if (target.checked) state.hidden.delete(block);
    else state.hidden.add(block);
    look();
  });
  $("sets-more").addEventListener("toggle", showSets);
  $("controls").addEventListener("submit", (event) => event.preventDefault());
  $("help-button").addEventListener("click", () => $("help").showModal());
  $("licences-more").addEventListener("toggle", () => {
    $("licences-text").textContent = $("licences").textContent;
  });
  $("picture").addEventListener("dblclick", fit);
  takePointers($("picture"), changeCamera);
}

const KEYS = {
  f: fit,
  e: () => $("edges").click(),
  "[": () => choosePlace(state.place - 1),
  "]": () => choosePlace(state.place + 1),
  " ": play,
  o: () => $("file-input").click(),
  "?": () => $("help").showModal(),
  c: () => {
    if (state.frame === null) return;
    const { options, selectedIndex } = $("clip");
    $("clip").selectedIndex = (selectedIndex + 1) % options.length;
    chooseClip(false);
  },
};

function connectKeys() {
  document.addEventListener("keydown", (event) => {
    const isOver = event.target === document.body || event.target === $("picture");
    if (!isOver || event.ctrlKey || event.altKey || event.metaKey || $("help").open) return;
    const { key } = event;
    const how = cameraKey(event);
    const side = key === "7" ? state.first ?? USUAL_VIEW : SIDES[key];
    if (how !== null) {
      changeCamera(how);
    } else if (side !== undefined) {
      changeCamera((camera) => ({ ...camera, ...cameraFrom(side) }));
      fit();
    } else if (Object.hasOwn(KEYS, key.toLowerCase())) {
      KEYS[key.toLowerCase()]();
    } else {
      return;
    }
    event.preventDefault();
  });
}

function connectDrops() {
  const stage = $("stage");
  document.addEventListener("dragover", (event) => {
    event.preventDefault();
    stage.classList.add("dragged");
  });
  document.addEventListener("dragleave", (event) => {
    if (event.relatedTarget === null) stage.classList.remove("dragged");
  });
  document.addEventListener("drop", (event) => {
    event.preventDefault();
    stage.classList.remove("dragged");
    const [file] = event.dataTransfer.files;
    if (file) openFile(file, file.name);
  });
}

async function begin() {
  drawing = new Drawing($("picture"), (lost) => {
    if (lost === null) $("error").hidden = true;
    else fail(lost);
  });
  new ResizeObserver(() => drawing.change({})).observe($("picture"));
  drawTriad();
  connectControls();
  connectKeys();
  connectDrops();
  const inside = fileInside();
  if (inside !== null) return openFile(inside.source, inside.name);
  const wanted = wantedOf(location.search, document.baseURI);
  if (wanted.url === null) return undefined;
  const name = new URL(wanted.url).pathname.split("/").pop();
  return openFile(wanted.url, name === "" ? wanted.url : name, wanted.segment);
}

begin().catch(fail);

// What the page does by itself, without asking the server: patterns over the map, the cell under the pointer,
// keys, and playing trajectories.  The callbacks of the Bokeh models call these functions.
"use strict"

const sweep = (() => {
  /** A number as pictures have it, such as −2×10⁻⁵. */
  function number(at) {
    const [digits, power] = at.toExponential(5).split("e").map(Number)
    if (!(power < -4 || power >= 6)) return String(Number(at.toPrecision(6))).replace("-", "−")
    const ten = `10${[...String(power)].map((c) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[c] ?? "⁻").join("")}`
    return `${digits}×${ten}`.replace("-", "−").replace(/^(−?)1×/, "$1")
  }

  // ---- cells and edges

  /** Index of the last of ascending numbers that is not after `at`, or 0. */
  function before(numbers, at) {
    let low = 0, high = numbers.length - 1
    while (low < high) {
      const middle = (low + high + 1) >> 1
      if (numbers[middle] <= at) low = middle
      else high = middle - 1
    }
    return low
  }

  /** Index of the cell whose edges enclose `at`, or -1. */
  function cell(edges, at) {
    const last = edges.length - 1
    return at >= edges[0] && at <= edges[last] ? Math.min(before(edges, at), last - 1) : -1
  }

  /** For each of `count` pixels along an axis, the index of its cell or -1. */
  function indices(edges, range, log, count) {
    const found = new Int32Array(count)
    const [start, end] = log ? [Math.log(range.start), Math.log(range.end)] : [range.start, range.end]
    for (let k = 0; k < count; k++) {
      const at = start + ((k + 0.5) / count) * (end - start)
      found[k] = cell(edges, log ? Math.exp(at) : at)
    }
    return found
  }

  // ---- patterns over cells that are not plain results, drawn in screen pixels at every zoom

  function paint({figure, cells, tiles, overlay, ex, ey}) {
    const width = Math.round(figure.inner_width), height = Math.round(figure.inner_height)
    const [table] = cells.data.kinds
    if (!(width > 1 && height > 1)) return
    const [x, y] = [figure.x_range, figure.y_range]
    const columns = indices(ex, x, figure.x_scale.type === "LogScale", width)
    const rows = indices(ey, y, figure.y_scale.type === "LogScale", height)
    const across = ex.length - 1
    const out = new Uint32Array(width * height)
    for (let r = 0; r < height; r++) {
      if (rows[r] < 0) continue
      for (let c = 0; c < width; c++) {
        const bits = columns[c] < 0 ? 0 : table[rows[r] * across + columns[c]]
        if (!bits) continue
        for (let k = 0; k < tiles.length; k++) {
          const {side, colours} = tiles[k]
          const colour = bits & (1 << k) ? colours[(r % side) * side + (c % side)] : 0
          if (colour) {
            out[r * width + c] = colour
            break
          }
        }
      }
    }
    const NDArray = overlay.data.image[0].constructor
    overlay.data = {image: [new NDArray(out, [height, width])], x: [x.start], y: [y.start],
                    dw: [x.end - x.start], dh: [y.end - y.start]}
  }

  const due = new Map()

  /** Paint once before the next frame, however many things changed. */
  function repaint(map) {
    if (due.has(map.figure.id)) return
    due.set(map.figure.id, requestAnimationFrame(() => {
      due.delete(map.figure.id)
      paint(map)
    }))
  }

  // ---- the chosen cell, the one under the pointer, and requests to the server

  let current = null

  /** Take note of the map that is shown; called for every new figure. */
  function use(map) {
    repaint(map)
    if (current?.figure !== map.figure) requestAnimationFrame(zoom)
    current = map
    keep()
    cut(...map.cut ?? chosen(map.cursor))
  }

  /** Draw the values of the row and of the column of a cell; with cells without a value, there are gaps. */
  function cut(i, j) {
    const {cuts, cells, blank, ex, first} = current
    if (i < 0 || j < 0) [i, j] = first
    current.cut = [i, j]
    const {image: [values], kinds: [bits]} = cells.data, across = ex.length - 1
    cuts.forEach(({plot, at}, n) => {
      const [along, other] = n ? [j, cuts[0]] : [i, cuts[1]]
      const cell = (k) => n ? k * across + i : j * across + k
      const value = Array.from(at, (_, k) => bits[cell(k)] & blank ? NaN : values[cell(k)])
      plot.renderers[0].data_source.data = {at, value, here: value.map((v, k) => k === along ? v : NaN)}
      const known = value.filter(Number.isFinite), low = Math.min(...known), high = Math.max(...known)
      const room = high > low ? (high - low) / 20 : 1
      if (known.length) plot.y_range.setv({start: low - room, end: high + room})
      plot.title.text = other ? `at ${other.symbol} = ${number(other.values[n ? i : j])}` : " "
    })
  }

  function choose(i, j) {
    const {cursor, ex, ey} = current
    cut(i, j)
    const [left, right, bottom, top] = [ex[i], ex[i + 1], ey[j], ey[j + 1]]
    cursor.data = {left: [left], right: [right], bottom: [bottom], top: [top], i: [i], j: [j]}
  }

  function ask(request, i, j, add) {
    request.data = {i: [i], j: [j], add: [add], count: [request.data.count[0] + 1]}
  }

  function tap(event) {
    const i = cell(current.ex, event.x), j = cell(current.ey, event.y)
    if (i < 0 || j < 0) return
    choose(i, j)
    ask(current.request, i, j, Boolean(event.modifiers?.shift))
  }

  let waiting = 0

  /** Tell the server which cell is under the pointer, or else the chosen one: at most twenty times a second. */
  function point(event) {
    const {cursor, probe, ex, ey} = current
    const i = event ? cell(ex, event.x) : -1, j = event ? cell(ey, event.y) : -1
    const here = i < 0 || j < 0 ? chosen(cursor) : [i, j]
    if (here[0] >= 0 && String(here) !== String(current.cut)) cut(...here)
    clearTimeout(waiting)
    waiting = setTimeout(() => tell(probe, ...here), 50)
  }

  function tell(probe, i, j) {
    if (probe.data.i[0] !== i || probe.data.j[0] !== j) probe.data = {i: [i], j: [j]}
  }

  /** Say to a screen reader the value and the place of a cell. */
  function announce(i, j) {
    const {cuts, cells, blank, figure, ex} = current
    const k = j * (ex.length - 1) + i, value = cells.data.image[0][k]
    const flags = cuts[0].plot.left[0].major_label_overrides  // a Map, or an object once the server has changed it
    const words = (flags instanceof Map ? flags.get(value) : flags[value]) ?? number(value)
    const place = cuts.map(({symbol, values}, n) => `${symbol} = ${number(values[n ? j : i])}`).join(", ")
    const known = !(cells.data.kinds[0][k] & blank) && Number.isFinite(value)
    document.querySelector("#said").textContent = `${figure.title.text}: ${known ? words : "no value"}, at ${place}`
  }

  const chosen = (cursor) => [cursor.data.i[0] ?? -1, cursor.data.j[0] ?? -1]

  const STEPS = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]}

  function key(event) {
    if (!current || event.ctrlKey || event.altKey || event.metaKey) return
    const {cursor, request, probe, ex, ey, figure} = current
    const clamp = (at, edges, {bounds: [, end]}) => Math.max(0, Math.min([...edges].filter((edge) => edge < end).length - 1, at))
    const [i, j] = chosen(cursor)
    if (event.key in STEPS) {
      const [di, dj] = STEPS[event.key]
      const stride = event.shiftKey ? 10 : 1
      const next = i < 0 ? [0, 0] : [clamp(i + stride * di, ex, figure.x_range), clamp(j + stride * dj, ey, figure.y_range)]
      choose(...next)
      tell(probe, ...next)
      announce(...next)
    } else if (event.key === "Enter" && i >= 0) {
      ask(request, i, j, event.shiftKey)
    } else {
      return
    }
    event.preventDefault()
  }

  // ---- playing

  let player = null

  /** Show the slider's moment: the line in the curves, the body, and the path of the last while. */
  function moment({motion, shape, faces, trace, line, slider, trail, clock}) {
    const {value: time, end} = slider
    line.location = time
    clock.text = `t = ${time.toFixed(time < 100 ? 1 : 0)} ${slider.tags[0] ?? ""}`.trimEnd()
    const {time: times, turn, contact, path} = motion.data
    if (!times?.length) return
    const k = before(times, time), {points: [points], tones: [tones], matrix: [m], sun: [sun]} = shape.data
    const seen = ([x, y, z]) => {
      const [u, v, , w] = [0, 4, 8, 12].map((r) => m[r] * x + m[r + 1] * y + m[r + 2] * z + m[r + 3])
      return [u / w, v / w]
    }
    const count = points.length / 3, across = points.shape[2]
    const placed = Array.from({length: count}, (_, n) => {
      const from = [0, 1, 2].map((r) => points[n + r * count] - contact[3 * k + r])
      const at = [0, 3, 6].map((r) => [0, 1, 2].reduce((sum, c) => sum + turn[9 * k + r + c] * from[c], 0))
      return [at[0] + path[2 * k], at[1] + path[2 * k + 1], at[2]]
    })
    faces.data = drawn(placed, placed.map(seen), across, tones, sun)
    const begin = before(times, time - trail.value * end)
    const way = Array.from({length: k - begin + 1}, (_, n) => seen([path[2 * (begin + n)], path[2 * (begin + n) + 1], 0]))
    trace.data = {x: way.map(([x]) => x), y: way.map(([, y]) => y)}
  }

  /** The faces of a convex body that are turned to whoever looks at it, in the light of the sun. */
  function drawn(placed, seen, across, tones, sun) {
    const data = {xs: [], ys: [], colour: []}
    for (let n = 0; n + across < placed.length; n++) {
      if ((n + 1) % across === 0) continue
      const corners = [n, n + 1, n + across + 1, n + across]
      const [a, b, c, d] = corners.map((k) => seen[k])
      if ((c[0] - a[0]) * (d[1] - b[1]) - (c[1] - a[1]) * (d[0] - b[0]) <= 0) continue
      const [p, q, r, s] = corners.map((k) => placed[k])
      const [u, v] = [[0, 1, 2].map((k) => r[k] - p[k]), [0, 1, 2].map((k) => s[k] - q[k])]
      const normal = [0, 1, 2].map((k) => u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3])
      const light = 0.75 + (0.25 * normal.reduce((sum, x, k) => sum + x * sun[k], 0)) / Math.hypot(...normal)
      const face = n - Math.floor(n / across)
      data.xs.push([a[0], b[0], c[0], d[0]])
      data.ys.push([a[1], b[1], c[1], d[1]])
      data.colour.push(`rgb(${[0, 1, 2].map((k) => Math.round(255 * light * tones[3 * face + k]))})`)
    }
    return data
  }

  /** Play at once, if the page is to, unless the visitor prefers pages that rest. */
  function begin({button}) {
    button.active = Boolean(button.tags[0]) && !matchMedia("(prefers-reduced-motion: reduce)").matches
  }

  function play(models, active) {
    cancelAnimationFrame(player)
    if (!active) return
    const {slider, speed, button} = models
    if (slider.value >= slider.end) slider.value = slider.start
    let then = performance.now()
    const frame = (now) => {
      const next = slider.value + ((now - then) / 1000) * (slider.end / Number(speed.value))
      then = now
      slider.value = Math.min(next, slider.end)
      if (slider.value < slider.end) player = requestAnimationFrame(frame)
      else button.active = false
    }
    player = requestAnimationFrame(frame)
  }

  // ---- the dark page

  /** Make the page dark or light, by default as the system is; Bokeh takes its colours from the style sheet. */
  function theme(choice) {
    const wanted = matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light"
    document.documentElement.dataset.theme = choice ?? wanted
    ink()
    for (const model of window.Bokeh?.documents[0]?.all_models ?? []) Bokeh.index.find_one(model)?.request_repaint?.()
  }

  /** Give letters that no style sheet reaches a colour that can be read. */
  function ink() {
    const [colour, paper] = document.documentElement.dataset.theme === "dark" ? ["#b8c2cb", "#1c242b"] : ["#4a5560", "#fff"]
    for (const model of window.Bokeh?.documents[0]?.all_models ?? []) {
      const names = {ColorBar: ["major_label_text_color", "title_text_color"], Legend: ["label_text_color"]}[model.type]
      const glyph = model.name === "symbols" ? model.glyph : null
      for (const each of names ?? []) if (model[each] !== colour) model.setv({[each]: colour}, {sync: false})
      const drawn = {text_color: {value: colour}, background_fill_color: {value: paper}}
      if (glyph && glyph.text_color.value !== colour) glyph.setv(drawn, {sync: false})
    }
  }

  function turn() {
    theme(document.documentElement.dataset.theme === "dark" ? "light" : "dark")
  }

  theme()
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => theme())

  // ---- the address: the server's query, and the part of the map that is shown

  let shown = "", pushed = 0

  /** Take note of the query; without cells, the page has no part for trajectories. */
  function note(query) {
    shown = query
    document.documentElement.dataset.cells = query.includes("cell=") ? "some" : "none"
  }

  /** The part of the map that is shown, as the address has it: empty for the whole. */
  function part() {
    const spans = [current?.figure.x_range, current?.figure.y_range].filter(Boolean)
    const whole = spans.every(({start, end, bounds: [low, high]}) => start === low && end === high)
    return whole ? "" : `&zoom=${spans.flatMap(({start, end}) => [start, end]).map((at) => Number(at.toPrecision(6))).join(":")}`
  }

  /** Show the part of the map that the address names, or the whole map. */
  function zoom() {
    const asked = (new URLSearchParams(location.search).get("zoom") ?? "").split(":").map(Number)
    const spans = [current.figure.x_range, current.figure.y_range]
    const fits = asked.length === 4 && spans.every(({bounds: [low, high]}, n) =>
      low <= asked[2 * n] && asked[2 * n] < asked[2 * n + 1] && asked[2 * n + 1] <= high)
    spans.forEach((span, n) => {
      const [start, end] = fits ? asked.slice(2 * n, 2 * n + 2) : span.bounds
      span.setv({start, end})
    })
  }

  let keeping = 0

  /** Write the part of the map into the address, once it rests. */
  function keep() {
    clearTimeout(keeping)
    keeping = setTimeout(() => history.replaceState(null, "", `?${shown}${part()}`), 300)
  }

  /** The page is opened at the server's query; the part of the map stays. */
  function arrive(query) {
    note(query)
    const zoomed = new URLSearchParams(location.search).get("zoom")
    history.replaceState(null, "", `?${query}${zoomed ? `&zoom=${encodeURIComponent(zoomed)}` : ""}`)
  }

  /** The visitor's choices have another address; Back undoes one, and what a moving slider does is one. */
  function address(query) {
    if (query === shown) return
    const now = performance.now()
    history[now - pushed < 700 ? "replaceState" : "pushState"](null, "", `?${query}${part()}`)
    note(query)
    pushed = now
  }

  /** Once the page is there: Back asks the server, through `wanted`, for what the earlier address names. */
  function ready(wanted) {
    addEventListener("popstate", () => {
      note(location.search.slice(1).replace(/&zoom=[^&]*/, ""))
      wanted.data = {query: [shown]}
      requestAnimationFrame(zoom)
    })
    setInterval(() => { name(); ink() }, 500)
  }

  function ended(lost) {
    document.querySelector("#ended").hidden = !lost
  }

  /** Give sliders and tools the names and values that a screen reader says; Bokeh gives them none. */
  function name() {
    for (const {model, el, shadow_el} of Bokeh.index.query((view) => view.shadow_el)) {
      const handle = shadow_el.querySelector(".noUi-handle")
      if (handle) {
        handle.setAttribute("aria-label", model.title || model.name)
        const [, value] = (shadow_el.querySelector(".bk-slider-title")?.textContent ?? "").split(": ")
        if (value) handle.setAttribute("aria-valuetext", value)
      } else if (shadow_el.querySelector(".bk-tool-icon")) {
        el.setAttribute("role", "button")
        el.setAttribute("aria-label", el.title)
      }
    }
  }

  /** Show all values of the cell, or five. */
  function fold() {
    const {dataset} = document.documentElement
    if (dataset.rest) delete dataset.rest
    else dataset.rest = "shown"
  }

  async function copy(button) {
    await navigator.clipboard.writeText(location.href)
    const label = button.label
    button.label = "Copied"
    setTimeout(() => { button.label = label }, 1500)
  }

  document.addEventListener("DOMContentLoaded", () => document.querySelector("#map")?.addEventListener("keydown", key))

  return {address, arrive, begin, copy, ended, fold, moment, number, play, point, ready, tap, turn, use}
})()

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

  /** Index of the cell whose edges enclose `at`, or -1. */
  function cell(edges, at) {
    let low = 0
    let high = edges.length - 1
    if (!(at >= edges[low] && at <= edges[high])) return -1
    while (high - low > 1) {
      const middle = (low + high) >> 1
      if (edges[middle] <= at) low = middle
      else high = middle
    }
    return low
  }

  /** For each of `count` pixels along an axis, the index of its cell or -1. */
  function cells(edges, range, log, count) {
    const found = new Int32Array(count)
    const [start, end] = log ? [Math.log(range.start), Math.log(range.end)] : [range.start, range.end]
    for (let k = 0; k < count; k++) {
      const at = start + ((k + 0.5) / count) * (end - start)
      found[k] = cell(edges, log ? Math.exp(at) : at)
    }
    return found
  }

  // ---- patterns over cells that are not plain results, drawn in screen pixels at every zoom

  function paint({figure, kinds, tiles, overlay, ex, ey}) {
    const width = Math.round(figure.inner_width), height = Math.round(figure.inner_height)
    const table = kinds.data.kinds[0]
    if (!(width > 1 && height > 1)) return
    const [x, y] = [figure.x_range, figure.y_range]
    const columns = cells(ex, x, figure.x_scale.type === "LogScale", width)
    const rows = cells(ey, y, figure.y_scale.type === "LogScale", height)
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
    current = map
    repaint(map)
    cut(...map.cut ?? chosen(map.cursor))
  }

  /** Draw the values of the row and of the column of a cell; with cells without a value, there are gaps. */
  function cut(i, j) {
    const {cuts, cells, kinds, blank, ex, ey} = current
    if (i < 0 || j < 0) [i, j] = [(ex.length - 1) >> 1, (ey.length - 1) >> 1]
    current.cut = [i, j]
    const values = cells.data.image[0], bits = kinds.data.kinds[0], across = ex.length - 1
    cuts.forEach(({source, title, at, values: places, symbol}, n) => {
      const [along, other] = n ? [j, cuts[0]] : [i, cuts[1]]
      const cell = (k) => n ? k * across + i : j * across + k
      const value = Array.from(at, (_, k) => bits[cell(k)] & blank ? NaN : values[cell(k)])
      source.data = {at, value, here: value.map((v, k) => k === along ? v : NaN)}
      title.text = other ? `at ${other.symbol} = ${number(other.values[n ? i : j])}` : " "
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
    if (current.request) ask(current.request, i, j, Boolean(event.modifiers?.shift))
  }

  let waiting = 0

  /** Tell the server which cell is under the pointer, or else the chosen one: at most twenty times a second. */
  function point(event) {
    const {cursor, probe, ex, ey} = current
    const i = event ? cell(ex, event.x) : -1, j = event ? cell(ey, event.y) : -1
    const here = i < 0 || j < 0 ? chosen(cursor) : [i, j]
    if (here[0] >= 0 && String(here) !== String(current.cut)) cut(...here)
    clearTimeout(waiting)
    if (probe) waiting = setTimeout(() => tell(probe, ...here), 50)
  }

  function tell(probe, i, j) {
    if (probe.data.i[0] !== i || probe.data.j[0] !== j) probe.data = {i: [i], j: [j]}
  }

  const chosen = (cursor) => [cursor.data.i[0] ?? -1, cursor.data.j[0] ?? -1]

  const STEPS = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]}

  function key(event) {
    if (!current || event.ctrlKey || event.altKey || event.metaKey) return
    const {cursor, request, probe, ex, ey} = current
    const clamp = (at, edges) => Math.max(0, Math.min(edges.length - 2, at))
    const [i, j] = chosen(cursor)
    if (event.key in STEPS) {
      const [di, dj] = STEPS[event.key]
      const stride = event.shiftKey ? 10 : 1
      const next = i < 0 ? [0, 0] : [clamp(i + stride * di, ex), clamp(j + stride * dj, ey)]
      choose(...next)
      if (probe) tell(probe, ...next)
    } else if (event.key === "Enter" && request && i >= 0) {
      ask(request, i, j, event.shiftKey)
    } else {
      return
    }
    event.preventDefault()
  }

  // ---- playing

  let player = null

  /** Show the trajectories at the slider's moment: the line in the curves, and the path of the last while. */
  function moment({curves, trails, points, line, slider, trail, clock}) {
    const time = slider.value
    line.location = time
    clock.text = `t = ${time.toFixed(time < 100 ? 1 : 0)} ${slider.tags[0] ?? ""}`.trimEnd()
    curves.forEach((curve, k) => {
      const {time: t, contact_x: x, contact_y: y} = curve.data
      const end = before(t, time), begin = before(t, time - trail.value * slider.end)
      const some = t.length > 0 && time <= t[t.length - 1]
      trails[k].data = {x: Array.from(x.slice(begin, end + 1)), y: Array.from(y.slice(begin, end + 1))}
      points[k].data = end >= 0 && t.length ? {x: [x[end]], y: [y[end]], alpha: [some ? 1 : 0.35]} : {x: [], y: [], alpha: []}
    })
  }

  /** Index of the last sample not after `time`. */
  function before(t, time) {
    let low = 0, high = t.length - 1
    while (low < high) {
      const middle = (low + high + 1) >> 1
      if (t[middle] <= time) low = middle
      else high = middle - 1
    }
    return low
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

  /** Take over what was chosen last, or else what the system wants; Bokeh takes its colours from the style sheet. */
  function theme() {
    const wanted = matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light"
    document.documentElement.dataset.theme = localStorage.getItem("theme") ?? wanted
    for (const model of window.Bokeh?.documents[0]?.all_models ?? []) Bokeh.index.find_one(model)?.request_repaint?.()
  }

  function turn() {
    localStorage.setItem("theme", document.documentElement.dataset.theme === "dark" ? "light" : "dark")
    theme()
  }

  theme()
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", theme)

  // ---- address, downloads, pictures

  /** Call the function of this object that the server names. */
  function called({name: [name], given: [given]}) {
    api[name](...given)
  }

  function address(query) {
    history.replaceState(null, "", `?${query}`)
  }

  function save(bytes, name, type) {
    const link = document.createElement("a")
    link.href = URL.createObjectURL(new Blob([bytes], {type}))
    link.download = name
    link.click()
    setTimeout(() => URL.revokeObjectURL(link.href), 10_000)
  }

  /** The legend of the map as an image: an SVG may hold HTML. */
  async function legend(scale) {
    const view = Bokeh.index.find_one(Bokeh.documents[0].get_model_by_name("legend"))
    const text = view.shadow_el.querySelector(".bk-clearfix")
    const {width, height} = text.getBoundingClientRect()
    const {color, font} = getComputedStyle(text)
    const copy = Object.assign(text.cloneNode(true), {style: `color: ${color}; font: ${font}; margin-left: 12px`})
    const html = new XMLSerializer().serializeToString(copy)
    const [across, down] = [width + 12, height + 16]
    const svg = `<svg xmlns="http://www.w3.org/2000/svg" width="${scale * across}" height="${scale * down}">
      <foreignObject width="${across}" height="${down}" transform="scale(${scale})">${html}</foreignObject></svg>`
    const image = new Image()
    image.src = `data:image/svg+xml,${encodeURIComponent(svg)}`
    await image.decode()
    return image
  }

  /** The figures that can be seen, one below the other, with the page's title and the map's legend, as one PNG. */
  async function picture(figures, name) {
    const views = figures.map((figure) => Bokeh.index.find_one(figure)).filter((view) => view?.el.offsetParent)
    const layers = views.map((view) => view.export("png", true).canvas)
    const scale = window.devicePixelRatio
    layers.splice(1, 0, await legend(scale))
    const canvas = document.createElement("canvas")
    const head = 56 * scale
    canvas.width = Math.max(...layers.map((layer) => layer.width))
    canvas.height = layers.reduce((sum, layer) => sum + layer.height, head)
    const pen = canvas.getContext("2d")
    const {color, backgroundColor} = getComputedStyle(document.querySelector("#maps"))
    pen.fillStyle = backgroundColor
    pen.fillRect(0, 0, canvas.width, canvas.height)
    pen.fillStyle = color
    pen.font = `600 ${15 * scale}px system-ui, sans-serif`
    pen.fillText(document.querySelector("h1").textContent, 12 * scale, 22 * scale)
    pen.font = `${12 * scale}px system-ui, sans-serif`
    pen.fillText(document.querySelector("#constants").textContent, 12 * scale, 42 * scale)
    let y = head
    for (const layer of layers) {
      pen.drawImage(layer, 0, y)
      y += layer.height
    }
    canvas.toBlob((blob) => save(blob, name, "image/png"))
  }

  async function copy(button) {
    await navigator.clipboard.writeText(location.href)
    const label = button.label
    button.label = "Copied"
    setTimeout(() => { button.label = label }, 1500)
  }

  document.addEventListener("DOMContentLoaded", () => document.querySelector("#map")?.addEventListener("keydown", key))

  const api = {address, called, copy, moment, number, picture, play, point, save, tap, turn, use}
  return api
})()

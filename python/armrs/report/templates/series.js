document.querySelectorAll(".series").forEach(section => {
  const data = JSON.parse(section.querySelector("script").textContent), t = data.t_s, end = t.length - 1;
  const wide = 480, high = 190, left = 52, right = 10, top = 24, foot = 28, inner = wide - left - right;
  const boxes = [...section.querySelectorAll("input[type=checkbox]")], told = section.querySelector("output");
  const on = name => boxes.find(box => box.value === name).checked;
  const svg = (name, attributes, parent, text) => {
    const made = document.createElementNS(section.querySelector("svg").namespaceURI, name);
    for (const key in attributes) made.setAttribute(key, attributes[key]);
    if (text !== undefined) made.textContent = text;
    if (parent) parent.append(made);
    return made;
  };
  const round = (low, high, most) => {
    const raw = (high - low) / most, size = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 5, 10].map(f => f * size).find(s => s >= raw), ticks = [];
    for (let k = Math.ceil(low / step); k * step <= high + 1e-9 * step; k++) ticks.push(+(k * step).toPrecision(12));
    return ticks;
  };
  const shown = value => String(value).replace("-", "\u2212");
  let from = t[0], to = t[end], start = null;
  const x = time => left + inner * (time - from) / (to - from);
  const time = (event, picture) => {
    const box = picture.getBoundingClientRect(), place = (event.clientX - box.left) * wide / box.width;
    return from + (to - from) * Math.min(1, Math.max(0, (place - left) / inner));
  };
  const nearest = at => t.reduce((best, value, k) => Math.abs(value - at) < Math.abs(t[best] - at) ? k : best, 0);
  const pictures = data.panels.map(panel => {
    const picture = svg("svg", { viewBox: `0 0 ${wide} ${high}`, role: "img", "aria-label": `${panel.title} [${panel.unit}] over time` });
    section.querySelector(".panels").append(picture);
    return picture;
  });
  const draw = () => data.panels.forEach((panel, p) => {
    const picture = pictures[p], lines = panel.lines.filter(line => on(line.name));
    const inside = t.map((value, k) => k).filter(k => t[k] >= from && t[k] <= to);
    const values = lines.flatMap(line => inside.map(k => line.values[k])).filter(value => value !== null);
    let low = values.length ? values.reduce((a, b) => Math.min(a, b)) : 0, most = values.length ? values.reduce((a, b) => Math.max(a, b)) : 1;
    if (most - low < 1e-9) { low -= 0.5; most += 0.5; }
    const spare = 0.05 * (most - low);
    low -= spare; most += spare;
    const y = value => top + (high - top - foot) * (most - value) / (most - low);
    picture.replaceChildren();
    svg("text", { x: left, y: 14, class: "name" }, picture, `${panel.title} [${panel.unit}]`);
    for (const tick of round(low, most, 4)) {
      svg("path", { d: `M${left} ${y(tick)}h${inner}`, class: "grid" }, picture);
      svg("text", { x: left - 6, y: y(tick) + 4, class: "tick end" }, picture, shown(tick));
    }
    for (const tick of round(from, to, 8)) {
      svg("path", { d: `M${x(tick)} ${top}V${high - foot}`, class: "grid" }, picture);
      svg("text", { x: x(tick), y: high - 12, class: "tick middle" }, picture, shown(tick));
    }
    for (const line of lines) {
      let path = "", pen = false;
      for (const k of inside) {
        const value = line.values[k];
        if (value !== null) path += `${pen ? "L" : "M"}${x(t[k]).toFixed(1)} ${y(value).toFixed(1)}`;
        pen = value !== null;
      }
      svg("path", { d: path, stroke: line.colour, class: line.name === "measured" ? "line broad" : "line" }, picture);
    }
    svg("path", { class: "cursor" }, picture);
    svg("rect", { class: "drag", y: top, height: high - top - foot, width: 0 }, picture);
  });
  const look = at => {
    const k = nearest(at);
    pictures.forEach(picture => picture.querySelector(".cursor").setAttribute("d", `M${x(t[k])} ${top}V${high - foot}`));
    const read = data.panels.map(panel => panel.title + ": " + panel.lines.filter(line => on(line.name))
      .map(line => `${line.name} ${line.values[k] === null ? "missing" : shown(line.values[k])}`).join(", ") + ` ${panel.unit}`);
    told.textContent = `${t[k].toFixed(3)} s. ${read.join("; ")}`;
  };
  const zoom = (low, high) => {
    const least = 4 * (t[end] - t[0]) / end, middle = (low + high) / 2, half = Math.max(high - low, least) / 2;
    from = Math.max(t[0], middle - half); to = Math.min(t[end], middle + half);
    draw();
  };
  const moves = {
    in: () => zoom(from + (to - from) / 4, to - (to - from) / 4),
    out: () => zoom(from - (to - from) / 2, to + (to - from) / 2),
    earlier: () => { const by = Math.min(from - t[0], (to - from) / 2); from -= by; to -= by; draw(); },
    later: () => { const by = Math.min(t[end] - to, (to - from) / 2); from += by; to += by; draw(); },
    whole: () => zoom(t[0], t[end]),
  };
  section.querySelectorAll("button").forEach(button => button.addEventListener("click", moves[button.value]));
  boxes.forEach(box => box.addEventListener("change", draw));
  pictures.forEach(picture => {
    picture.addEventListener("pointerdown", event => { start = time(event, picture); picture.setPointerCapture(event.pointerId); });
    picture.addEventListener("pointermove", event => {
      const now = time(event, picture);
      look(now);
      if (start === null) return;
      const drag = picture.querySelector(".drag");
      drag.setAttribute("x", Math.min(x(start), x(now)));
      drag.setAttribute("width", Math.abs(x(now) - x(start)));
    });
    picture.addEventListener("pointerup", event => {
      const stop = time(event, picture), [low, high] = [Math.min(start, stop), Math.max(start, stop)];
      if (start !== null && high - low > 0.01 * (to - from)) zoom(low, high);
      start = null;
    });
    picture.addEventListener("dblclick", moves.whole);
  });
  draw();
});

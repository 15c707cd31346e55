document.querySelectorAll(".film").forEach(film => {
  const [chains, times] = JSON.parse(film.querySelector("script").textContent);
  const sticks = film.querySelectorAll(".stick"), slider = film.querySelector("input");
  const button = film.querySelector("button"), clock = film.querySelector("output");
  let frame = 0, playing = !matchMedia("(prefers-reduced-motion: reduce)").matches, before = 0;
  const show = () => {
    chains.forEach((poses, k) => sticks[k].setAttribute("points", poses[frame]));
    slider.value = frame;
    clock.textContent = times[frame].toFixed(2) + " s";
    button.textContent = playing ? "Pause" : "Play";
  };
  const step = now => {
    const wait = 1000 * (times[1] - times[0]);
    if (playing && film.offsetParent !== null && now - before >= wait) {
      frame = (frame + 1) % times.length; before = now; show();
    }
    requestAnimationFrame(step);
  };
  button.addEventListener("click", () => { playing = !playing; show(); });
  slider.addEventListener("input", () => { playing = false; frame = +slider.value; show(); });
  show();
  requestAnimationFrame(step);
});

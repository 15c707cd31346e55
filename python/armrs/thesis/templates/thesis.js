const parts = [...document.querySelectorAll(".part")], buttons = [...document.querySelectorAll("nav button")];
const open = key => {
  parts.forEach(part => part.hidden = part.id !== key);
  buttons.forEach(button => button.setAttribute("aria-current", button.dataset.part === key));
};
const follow = () => {
  const target = document.getElementById(decodeURIComponent(location.hash.slice(1)));
  if (!target) return;
  open(target.closest(".part").id);
  target.scrollIntoView();
};
buttons.forEach(button => button.addEventListener("click", () => { open(button.dataset.part); scrollTo(0, 0); }));
addEventListener("hashchange", follow);
open(parts[0].id);
follow();

/* The button that changes between a light and a dark page. */
"use strict";

const themeButton = document.getElementById("theme");

function isDark() {
  const chosen = document.documentElement.dataset.theme;
  if (chosen) return chosen === "dark";
  return window.matchMedia("(prefers-color-scheme: dark)").matches;
}

/* Redraws are done by listeners of the event "look", because canvases do not read style sheets. */
function announceLook() {
  themeButton.setAttribute("aria-pressed", String(isDark()));
  window.dispatchEvent(new Event("look"));
}

themeButton.hidden = false;
themeButton.addEventListener("click", () => {
  document.documentElement.dataset.theme = isDark() ? "light" : "dark";
  announceLook();
});
window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", announceLook);
window.addEventListener("resize", announceLook);
themeButton.setAttribute("aria-pressed", String(isDark()));

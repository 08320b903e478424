// The player: a slider, keys and buttons that move through the episodes of a playback, one tab for each kind.
"use strict";

function player(root, data) {
  root.hidden = false; // first, as what is hidden has no size
  const view = stage(root, data);
  const find = (css) => root.querySelector(css);
  const tabs = [...root.querySelectorAll("[role=tab]")];
  const slider = find(".slider");
  const chooser = find(".chooser");
  const button = find(".play");
  let steps = [];
  let scores = [];
  let at = 0;
  let clock = 0;

  function go(to) {
    at = Math.max(0, Math.min(steps.length - 1, to));
    const step = steps[at];
    view.show(step, scores[at]);
    slider.value = at;
    find(".place").textContent = `${at} of ${steps.length - 1}`;
    const said = `Step ${at} of ${steps.length - 1}. ${view.say(step)}`;
    slider.setAttribute("aria-valuetext", `step ${at} of ${steps.length - 1}`);
    if (!clock) find(".live").textContent = said; // while it plays, nobody could listen as fast
    find(".back").disabled = find(".first").disabled = at === 0;
    find(".on").disabled = find(".last").disabled = at === steps.length - 1;
    if (clock && at === steps.length - 1) play(false);
  }

  function open(episode) {
    steps = episode.steps;
    let sum = 0;
    scores = steps.map((step) => step.reward === undefined ? undefined : +(sum += step.reward).toFixed(6));
    slider.max = steps.length - 1;
    const free = new Set(data.free);
    const far = Math.max(1, steps.length - 1);
    find(".marks").replaceChildren(...steps.flatMap((step, k) => {
      if (!step.word || !step.word.some((number) => free.has(number))) return [];
      const mark = element("span", "");
      mark.style.left = `calc(8px + (100% - 16px) * ${(k / far).toFixed(4)})`;
      return [mark];
    }));
    play(false);
    go(0);
  }

  function select(k) {
    const reel = data.reels[k];
    tabs.forEach((tab, i) => {
      tab.setAttribute("aria-selected", i === k);
      tab.tabIndex = i === k ? 0 : -1;
    });
    find("[role=tabpanel]").setAttribute("aria-labelledby", tabs[k].id);
    find(".note").textContent = reel.note;
    chooser.replaceChildren(...reel.episodes.map((episode, i) => {
      const option = element("option", "", episode.title.replace("-", "\u2212"));
      option.value = i;
      return option;
    }));
    chooser.parentElement.hidden = reel.episodes.length < 2;
    find(".title").textContent = reel.episodes.length < 2 ? reel.episodes[0].title.replace("-", "\u2212") : "";
    chooser.onchange = () => open(reel.episodes[+chooser.value]);
    open(reel.episodes[0]);
  }

  function play(wanted) {
    clearInterval(clock);
    if (wanted && at === steps.length - 1) go(0);
    clock = wanted ? setInterval(() => go(at + 1), 650) : 0;
    button.textContent = wanted ? "Pause" : "Play";
    button.setAttribute("aria-pressed", Boolean(wanted));
  }

  const keys = {
    ArrowLeft: () => go(at - 1), ArrowRight: () => go(at + 1), Home: () => go(0),
    End: () => go(steps.length - 1), " ": () => play(!clock),
  };

  function onScreen() {
    const box = root.getBoundingClientRect();
    return box.top < innerHeight * 0.7 && box.bottom > innerHeight * 0.3;
  }

  document.addEventListener("keydown", (pressed) => {
    const target = pressed.target;
    const elsewhere = target !== document.body && !root.contains(target);
    const own = pressed.key === " " ? "select, button, [role=tab], a, summary" : "select, input, [role=tab]";
    const itself = target.closest && target.closest(own); // these have a use for the key themselves
    if (!keys[pressed.key] || pressed.ctrlKey || pressed.metaKey || pressed.altKey) return;
    if (elsewhere || itself || !onScreen()) return;
    if (target === document.body && (pressed.key === " " || pressed.key === "Home" || pressed.key === "End")) return;
    pressed.preventDefault();
    keys[pressed.key]();
  });
  tabs.forEach((tab, k) => {
    tab.addEventListener("click", () => select(k));
    tab.addEventListener("keydown", (pressed) => {
      const to = { ArrowLeft: k - 1, ArrowRight: k + 1, Home: 0, End: tabs.length - 1 }[pressed.key];
      if (to === undefined) return;
      pressed.preventDefault();
      const next = (to + tabs.length) % tabs.length;
      select(next);
      tabs[next].focus();
    });
  });
  slider.addEventListener("input", () => { play(false); go(+slider.value); });
  button.addEventListener("click", () => play(!clock));
  find(".first").addEventListener("click", keys.Home);
  find(".back").addEventListener("click", keys.ArrowLeft);
  find(".on").addEventListener("click", keys.ArrowRight);
  find(".last").addEventListener("click", keys.End);
  select(0);
}

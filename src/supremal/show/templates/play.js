// The game: shows a moment, and asks the server for the next one when somebody has chosen.  The moves that were
// made are all that there is to know; they stand in the address, so that a page loaded again goes on.
"use strict";

(() => {
  const root = document.getElementById("play");
  const scene = { ...JSON.parse(document.getElementById("scene").textContent), names: [], free: [], texts: [] };
  const free = new Set(scene.uncontrollable);
  const find = (css) => root.querySelector(css);
  root.hidden = false; // first, as what is hidden has no size
  const view = stage(root, scene);
  const asks = element("div", "asks", element("h4", ""), element("ul", "outcomes"));
  find(".choices").prepend(asks);
  let moves = location.hash.slice(1).split(",").filter(Boolean).map(Number);
  let drawn = moves.map(() => false); // which of them chance made by itself
  let moment = null;
  let busy = false;

  async function ask(wanted) {
    const answer = await fetch("moment", {
      method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify({ moves: wanted }),
    });
    const found = await answer.json();
    if (!answer.ok) throw new Error(found.error);
    return found;
  }

  async function go(wanted, by) {
    if (busy) return;
    busy = true;
    try {
      let found = await ask(wanted);
      if (found.asked && find(".auto").checked && wanted.length > moves.length) {
        wanted = [...wanted, found.chance];
        by = [...by, true];
        found = await ask(wanted);
      }
      [moment, moves, drawn] = [found, wanted, by];
      history.replaceState(null, "", moves.length ? `#${moves}` : location.pathname);
      show();
      find(".trouble").hidden = true;
    } catch (problem) {
      const away = problem instanceof TypeError; // what fetch throws where nobody answers
      find(".trouble").textContent = away ? "Nobody answers: is supremal play still running?" : problem.message;
      find(".trouble").hidden = false;
    } finally {
      busy = false;
    }
  }

  const choose = (k) => go([...moves, k], [...drawn, false]);
  const restart = () => go([], []);

  function undo() { // with what chance did by itself since
    let left = moves.length - 1;
    while (left > 0 && drawn[left]) left -= 1;
    if (moves.length) go(moves.slice(0, left), drawn.slice(0, left));
  }

  function button(k, ...said) {
    const made = element("button", "event", ...(k < 9 ? [element("span", "key", String(k + 1))] : []), ...said);
    made.type = "button";
    made.addEventListener("click", () => choose(k));
    return made;
  }

  const shown = (name) => element("span", "event" + (free.has(name) ? " free" : ""), symbol(name));
  const chips = (word) => word.length ? word.map(shown) : [element("span", "faint", "nothing")];

  function offer() {
    const names = moment.asked ? [] : moment.options.map((option) => option.word[0]);
    for (const item of root.querySelectorAll(".can li, .may li")) {
      const k = names.indexOf(item.dataset.name);
      if (k >= 0) item.firstChild.replaceWith(button(k, symbol(names[k])));
    }
    asks.hidden = !moment.asked;
    if (!moment.asked) return;
    asks.firstChild.replaceChildren(symbol(moment.asked), " is chosen. What happens?");
    asks.lastChild.replaceChildren(...moment.options.map((option, k) => {
      const tells = option.tells ? [element("span", "told", option.tells)] : [];
      const css = option.word.some((name) => free.has(name)) ? "free" : "";
      return element("li", css, button(k, ...chips(option.word), element("span", "share", option.share), ...tells));
    }));
  }

  function show() {
    const held = document.activeElement && document.activeElement.closest("button.event");
    Object.assign(scene, { names: moment.names, free: moment.free, texts: moment.texts });
    const score = moment.score === null ? undefined : moment.score;
    view.show(moment.step, score);
    offer();
    const over = moment.options.length === 0;
    find(".over").hidden = !over;
    find(".over").textContent = moment.step.not.length ? "Nothing more may happen." : "The game is over.";
    const steps = moment.history.length;
    find(".place").textContent = `${steps} ${steps === 1 ? "step" : "steps"}` +
      (score === undefined ? "" : `, score ${signed(score)}`);
    find(".past").replaceChildren(...moment.history.map((word) => element("li", "", ...chips(word))));
    find(".past").scrollTop = find(".past").scrollHeight;
    find(".so-far").hidden = find(".past").hidden = steps === 0;
    find(".always").hidden = score === undefined; // events of plants have no chances
    find(".undo").disabled = find(".restart").disabled = moves.length === 0;
    find(".draw").disabled = over;
    const said = moment.options.map((option, k) => `${k + 1}: ${[option.word.join(" ") || "nothing", option.share,
      option.tells].filter(Boolean).join(", ")}`).join("; ");
    find(".live").textContent = moment.asked ? `${moment.asked} is chosen. What happens? ${said}` : view.say(moment.step);
    const first = find("button.event");
    if (held && first) first.focus({ preventScroll: true });
  }

  find(".undo").addEventListener("click", undo);
  find(".restart").addEventListener("click", restart);
  find(".draw").addEventListener("click", () => choose(moment.chance));
  document.addEventListener("keydown", (pressed) => {
    if (!moment || pressed.ctrlKey || pressed.metaKey || pressed.altKey || pressed.repeat) return;
    const k = "123456789".indexOf(pressed.key);
    const wanted = k >= 0 && k < moment.options.length ? () => choose(k) :
      pressed.key === "Backspace" ? undo :
      pressed.key === "c" && moment.options.length ? () => choose(moment.chance) : null;
    if (!wanted) return;
    pressed.preventDefault();
    wanted();
  });
  go(moves, drawn).then(() => moment || go([], [])); // what the address says, and where that is none the start
})();

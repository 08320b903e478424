// The stage: draws one step of an episode.  A page of playback moves through steps that are known; one of play is
// given the next step when somebody has chosen an event, with the names, free and texts that it counts in.
//
//   const view = stage(root, scene);   // root: the element of _stage.html.j2; scene: names, free, parts, facts, texts
//   view.show(step);                   // a STEP of supremal.show.playback
//   view.say(step)                     // the same in one sentence, as text
//
// What can be chosen has [data-name].
"use strict";

function symbol(name) { // as the diagrams set it: a letter and a short index
  const found = /^([^\W\d_])(?:_(\w{1,2})|(\d{1,2}))$/u.exec(name);
  if (!found) return document.createTextNode(name);
  const all = document.createDocumentFragment();
  all.append(element("i", "", found[1]), element("sub", "", found[2] || found[3]));
  return all;
}

function element(tag, css, ...children) {
  const made = document.createElement(tag);
  if (css) made.className = css;
  made.append(...children);
  return made;
}

function signed(number) {
  return String(number).replace("-", "\u2212");
}

function listed(names) {
  return names.length < 2 ? names.join("") : names.slice(0, -1).join(", ") + " and " + names[names.length - 1];
}

function stage(root, scene) {
  const CELL = 40;
  let free = new Set();
  const part = (css) => root.querySelector("." + css);
  const tokens = [...root.querySelectorAll(".sm-board .token")];
  const turned = tokens.map(() => 0);
  const followers = scene.parts.map((one, k) => follower(part(one.kind === "rule" ? "followers" : "machines"), one, k));

  function follower(parent, one, k) {
    const where = element("span", "where");
    const figure = element("figure", one.kind === "rule" ? "of-rule" : "of-machine");
    const name = element("figcaption", "", element("b", "", one.name), " ", where);
    figure.append(name);
    const drawn = document.querySelector(`[data-automaton="${k}"] svg`);
    let nodes = [];
    if (drawn && one.kind === "rule") {
      const copy = drawn.cloneNode(true);
      nodes = [...copy.querySelectorAll("g.state")];
      figure.append(copy);
      parent.append(figure);
      fit(copy);
    } else if (one.states.length && one.states.length <= 24) {
      const track = element("ol", "track");
      nodes = one.states.map((state) => element("li", "", symbol(state)));
      track.append(...nodes);
      figure.append(track);
    }
    parent.append(figure);
    return (state) => {
      nodes.forEach((node, s) => node.classList.toggle("current", s === state));
      figure.classList.toggle("broken", state < 0);
      where.replaceChildren("in ", state < 0 ? "no state: it is broken" : symbol(one.states[state] || String(state)));
    };
  }

  function fit(copy) { // no larger than it is drawn, and without the labels where nobody could read them
    const [wide, high] = [copy.getAttribute("width"), copy.getAttribute("height")];
    copy.style.maxWidth = `${wide}px`;
    const seen = copy.getBoundingClientRect();
    if (!seen.width || Math.min(seen.width / wide, seen.height / high) > 0.56) return;
    copy.querySelectorAll(".label").forEach((label) => label.parentElement.remove());
    const box = copy.getBBox();
    copy.setAttribute("viewBox", `${box.x - 3} ${box.y - 3} ${box.width + 6} ${box.height + 6}`);
  }

  function place(token, k, at) {
    if (!at) {
      token.style.display = "none";
      return;
    }
    const [x, y, angle = 0, size = 1, look = ""] = at;
    turned[k] += ((angle - turned[k]) % 360 + 540) % 360 - 180; // the short way round
    token.style.display = "";
    token.style.transform = `translate(${x * CELL}px,${y * CELL}px) scale(${size})`;
    token.querySelector(".shape").style.transform = `rotate(${turned[k]}deg)`;
    token.classList.toggle("hollow", look === "hollow");
  }

  function event(number, css, ...more) {
    const item = element("li", css, element("span", "event", symbol(scene.names[number])), ...more);
    item.dataset.name = scene.names[number];
    return item;
  }

  function group(css, items) {
    const list = part(css);
    list.replaceChildren(...items);
    list.parentElement.hidden = items.length === 0;
  }

  function disabled(pairs) { // those with the same reason on one line
    const lines = new Map();
    for (const [number, why] of pairs) lines.set(why, [...(lines.get(why) || []), number]);
    return [...lines].map(([why, numbers]) => element("li", "",
      ...numbers.map((number) => {
        const event = element("span", "event", symbol(scene.names[number]));
        event.dataset.name = scene.names[number];
        return event;
      }), element("span", "told", scene.texts[why])));
  }

  function happened(step) {
    if (!step.word) return [element("span", "faint", "The start.")];
    const shown = (number) =>
      element("span", "event" + (free.has(number) ? " free" : ""), symbol(scene.names[number]));
    const word = step.word.length ? step.word.flatMap((number) => [shown(number), " "]) : ["nothing "];
    if (step.did === undefined) return [...word, "happened."];
    if (step.word.length === 1 && step.word[0] === step.did) return [...word, "happened, as chosen."];
    return [shown(step.did), " was chosen, ", ...word, "happened."];
  }

  return {
    show(step, score) {
      free = new Set(scene.free); // where somebody plays, each moment brings its own names
      tokens.forEach((token, k) => place(token, k, step.tokens && step.tokens[k]));
      const text = part("drawn");
      text.hidden = step.text === undefined;
      text.textContent = step.text === undefined ? "" : scene.texts[step.text];
      const facts = step.facts || [];
      part("facts").replaceChildren(...facts.map((fact, k) => {
        const row = element("div", "", element("dt", "", scene.facts[k] || ""), element("dd", ""));
        row.lastChild.textContent = scene.texts[fact];
        return row;
      }));
      part("happened").replaceChildren(...happened(step));
      part("earned").textContent = step.reward === undefined ? "" :
        `reward ${signed(step.reward)}` + (score === undefined ? "" : `, so far ${signed(score)}`);
      followers.forEach((follow, k) => follow(step.at[k] === undefined ? -1 : step.at[k]));
      group("can", step.can.map((number) =>
        event(number, number === step.next ? "next" : "", ...(number === step.next ? [element("span", "told", "taken next")] : []))));
      group("may", step.may.map((number) => event(number, "free")));
      group("cannot", disabled(step.not));
      part("over").hidden = step.can.length + step.may.length + step.not.length > 0;
    },
    say(step) {
      const name = (number) => scene.names[number];
      const word = step.word && (step.word.length ? listed(step.word.map(name)) + " happened" : "nothing happened");
      const chose = step.did === undefined ? "" : `${name(step.did)} was chosen, `;
      const came = step.word ? chose + word + (step.reward === undefined ? "" : `, reward ${step.reward}`) + ". " : "";
      const can = step.can.length ? `Enabled: ${listed(step.can.map(name))}. ` : "";
      const may = step.may.length ? `Can happen, and nobody controls it: ${listed(step.may.map(name))}. ` : "";
      const not = step.not.map(([number, why]) => `${name(number)} is disabled: ${scene.texts[why]}. `).join("");
      return came + can + may + not;
    },
  };
}

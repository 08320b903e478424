// The page: starts the player, and searches the table of what is disabled.
"use strict";

(() => {
  const island = document.getElementById("playback-data");
  if (island) player(document.querySelector(".player"), JSON.parse(island.textContent));

  const search = document.getElementById("search");
  if (!search) return;
  const rows = [...document.querySelectorAll("#disabled-rows > tr")];
  const texts = rows.map((row) => row.textContent.toLowerCase().replace(/\s+/g, " "));
  search.parentElement.hidden = false;
  search.addEventListener("input", () => {
    const words = search.value.toLowerCase().split(/\s+/).filter(Boolean);
    let shown = 0;
    rows.forEach((row, k) => {
      row.hidden = !words.every((word) => texts[k].includes(word));
      shown += !row.hidden;
    });
    document.getElementById("found").textContent = words.length ? `${shown} of ${rows.length} rows` : "";
  });
})();

// What stands over the picture when there is none, or none that is new, and what is said in passing.

import {hasToken} from "./service.js";

const TITLES = {
  busy: "The service is busy",
  rebuilding: "The device is being rebuilt",
  gone: "Not there",
  refused: "Refused",
  token: "A token is needed",
  offline: "No connection",
};

/** Says what passes, below. */
export function say(text) {
  const said = document.getElementById("said");
  said.textContent = "";
  said.getBoundingClientRect(); // so that the same words are shown, and read, again
  said.textContent = text;
}

/** Shows the stage's state in `box`; its button asks again, by `open` when nothing is open yet. Who has shown no token yet
 * is told `where` to get one in: the service's own words are for programs. */
export function notices(stage, box, again, open, where) {
  let counting = 0;
  stage.addEventListener("state", ({detail: problem}) => {
    clearInterval(counting);
    box.hidden = !problem;
    if (!problem) return;
    let seconds = Math.ceil(problem.seconds ?? 0);
    const message = problem.kind === "token" && !hasToken() ? where : problem.message;
    box.querySelector("p").textContent = `${TITLES[problem.kind] ?? "Failed"}: ${message}`;
    const tell = () => {
      box.querySelector("small").textContent = !problem.seconds
        ? ""
        : seconds > 0
          ? `Trying again in ${seconds} s`
          : "Trying again";
      seconds--;
    };
    tell();
    again.hidden = Boolean(problem.seconds) && Boolean(stage.dataset);
    if (!problem.seconds) return;
    counting = setInterval(tell, 1000);
    if (!stage.dataset) setTimeout(open, problem.seconds * 1000); // else the stage does
  });
  again.addEventListener("click", open);
}

// Has the service make a tour: begins it, says how far it is, offers what came out.

import {isNumber} from "./link.js";
import {taken} from "./methods.js";
import {Problem, ask, askJson, download} from "./service.js";

const POLL_MS = 700;
const $ = (id) => document.getElementById(id);

function tell(status) {
  const left = status.remaining_s > 0 ? `, ${Math.ceil(status.remaining_s)} s left` : "";
  return (
    {
      rendering: `${status.frames_done} of ${status.frames} frames${left}`,
      video: "Making the video",
      done: `${status.frames} frames are ready`,
      failed: `Failed: ${status.error}`,
    }[status.state] ?? status.state
  );
}

export function renderTours(tour, say) {
  let uri = null; // of the tour that is shown

  const show = (status) => {
    const ended = status.state === "done" || status.state === "failed";
    $("making").hidden = false;
    $("progress").value = status.progress;
    $("progress").hidden = ended;
    $("far").textContent = tell(status);
    $("cancel").textContent = ended ? "Remove" : "Cancel";
    $("result").hidden = status.state !== "done";
    $("result").onclick = () =>
      download(status.video ?? status.zip, `${status.dataset}-tour.${status.video ? "mp4" : "zip"}`).catch((e) =>
        say(e.message),
      );
    $("result").textContent = status.video ? "Save MP4" : "Save ZIP";
    return ended;
  };

  const follow = async (followed) => {
    while (uri === followed) {
      try {
        if (show(await askJson(followed))) return say($("far").textContent);
      } catch (problem) {
        if (!(problem instanceof Problem) || problem.kind === "gone") return ($("making").hidden = true);
      }
      await new Promise((done) => setTimeout(done, POLL_MS));
    }
  };

  $("render").addEventListener("click", async () => {
    const {budget: _, ...setting} = tour.stage.settings; // one setting for all frames
    const [width, height] = [$("tour-width"), $("tour-height")];
    if (![width, height].every((input) => input.reportValidity())) return;
    const settings = {
      ...Object.fromEntries(
        Object.entries(taken(setting, setting.layer))
          .filter(([, value]) => value !== "")
          .map(([name, value]) => [name, isNumber(name) ? Number(value) : value]),
      ),
      format: "jpeg",
      width: Number(width.value),
      height: Number(height.value),
    };
    const body = JSON.stringify({path: tour.document(), settings, video: $("video").value === "mp4"});
    try {
      const reply = await ask(`${tour.stage.dataset.uri}/tours`, {
        method: "POST",
        body,
        headers: {"Content-Type": "application/json"},
      });
      const status = await reply.json();
      uri = status.uri;
      show(status);
      follow(uri);
    } catch (problem) {
      say(problem.message);
    }
  });
  $("cancel").addEventListener("click", () => {
    ask(uri, {method: "DELETE"}).catch((problem) => say(problem.message));
    uri = null;
    $("making").hidden = true;
  });
  tour.addEventListener("change", () => ($("render").disabled = !tour.legs.length));
}

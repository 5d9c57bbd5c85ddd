// Which classes are drawn: a box for each that the dataset has, with its name and its colour as the service has them.
//
// Without more said, unticking hides exactly those (class=!7), so that what has no class stays; a link that names those to
// be drawn (class=2,6) keeps doing so.

const $ = (id) => document.getElementById(id);
const TERMS_MOST = 12; // items of a list that the service takes beside a few clips

/** "3-5,9" of whole numbers, rising. */
function ranges(numbers) {
  const runs = [];
  for (const number of numbers) {
    const last = runs.at(-1);
    if (last?.[1] === number - 1) last[1] = number;
    else runs.push([number, number]);
  }
  return runs.map(([a, b]) => (a === b ? `${a}` : `${a}-${b}`));
}

/** The numbers among `all` that a list names; null where it is no list. */
function listed(text, all) {
  const named = text.split(",").map((part) => part.trim().match(/^(\d+)(?:(?:-|\.\.)(\d+))?$/));
  if (!named.every(Boolean)) return null;
  return all.filter((number) => named.some(([, low, high = low]) => number >= Number(low) && number <= Number(high)));
}

/** As a share is read: 0.4 %, 12 %. */
const percent = (share) => `${(100 * share).toFixed(share > 0 && share < 0.1 ? 1 : 0)} %`;

export class Classes extends EventTarget {
  /** Fires "change". */
  constructor() {
    super();
    this.text = "";
    this.kinds = [];
    $("classes-list").addEventListener("change", () => this.write());
    for (const [id, ticked] of [["classes-all", true], ["classes-none", false]])
      $(id).addEventListener("click", () => {
        this.only = false;
        for (const box of this.boxes) box.checked = ticked;
        this.write();
      });
  }

  get boxes() {
    return [...$("classes-list").querySelectorAll("input")];
  }

  /** Another dataset, and which of its classes are drawn by now. */
  open(dataset, text = "") {
    const values = dataset.attributes.find(({name}) => name === "class")?.values;
    this.kinds = values?.kinds ?? [];
    this.text = `${text}`.trim();
    this.only = this.text !== "" && !this.text.startsWith("!");
    $("classes").hidden = !this.kinds.length;
    $("classes").open ||= Boolean(this.text);
    const all = this.kinds.map(({value}) => value),
      named = listed(this.text.replace("!", ""), all) ?? (this.only ? [] : all);
    $("classes-list").replaceChildren(
      ...this.kinds.map(({value, count, name, color}) => {
        const [label, box, swatch] = ["label", "input", "i"].map((tag) => document.createElement(tag));
        const checked = this.text === "" || named.includes(value) === this.only;
        Object.assign(box, {type: "checkbox", value, checked});
        swatch.style.background = color ?? "";
        const share = Object.assign(document.createElement("small"), {textContent: percent(count / values.count)});
        label.append(box, swatch, ` ${name ? `${value} ${name}` : value} `, share);
        return label;
      }),
    );
  }

  /** What of a view it says. */
  read() {
    return this.text ? {class: this.text} : {};
  }

  write() {
    const all = this.kinds.map(({value}) => value),
      shown = this.boxes.filter(({checked}) => checked).map(({value}) => Number(value)),
      hidden = all.filter((number) => !shown.includes(number));
    if (!shown.length) this.only = false; // an empty list would say nothing
    const [only, not] = [ranges(shown), ranges(hidden)];
    const names = this.only || (not.length > TERMS_MOST && only.length && only.length < not.length);
    this.text = !hidden.length ? "" : names ? only.join(",") : `!${not.join(",")}`;
    this.dispatchEvent(new Event("change"));
  }
}

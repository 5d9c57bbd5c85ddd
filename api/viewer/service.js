// Asks the service. What it refuses becomes a Problem that says what kind it is and when to come back.

export class Problem extends Error {
  constructor(kind, message, seconds = 0, field = "") {
    super(message);
    this.kind = kind; // "busy", "rebuilding", "gone", "refused", "token", "offline"
    this.seconds = seconds; // 0: asking again does not help
    this.field = field;
  }
}

let pass = ""; // what a signed page adds to its requests for its dataset
export const setPass = (parameters) => (pass = parameters);

const TOKEN = "splatd-token";
const KEPT_MS = 60000; // what is saved, until the browser has surely begun to
export const setToken = (token) => sessionStorage.setItem(TOKEN, token);
export const hasToken = () => Boolean(sessionStorage.getItem(TOKEN));

function kindOf(status, problem) {
  if (problem.field === "exp" || problem.field === "sig") return "refused"; // a token would not mend it
  if (status === 401 || status === 403) return "token";
  if (status === 404) return "gone";
  if (problem.type?.endsWith(":device-lost") || problem.type?.endsWith(":no-device")) return "rebuilding";
  return status >= 500 || status === 429 ? "busy" : "refused";
}

/** fetch() that throws Problems; 304s never come here. */
export async function ask(path, options = {}) {
  const token = sessionStorage.getItem(TOKEN);
  const headers = {
    Accept: "application/json, image/*, */*;q=0.5",
    ...(token && {Authorization: `Bearer ${token}`}),
    ...options.headers,
  };
  let reply;
  try {
    const signed = pass && path.startsWith("/v1/datasets/");
    reply = await fetch(signed ? `${path}${path.includes("?") ? "&" : "?"}${pass}` : path, {...options, headers});
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw new Problem("offline", "The service cannot be reached");
  }
  if (reply.ok) return reply;
  const problem = await reply.json().catch(() => ({}));
  const wait = reply.status >= 500 || reply.status === 429 ? Number(reply.headers.get("Retry-After")) || 2 : 0;
  throw new Problem(
    kindOf(reply.status, problem),
    problem.detail ?? `${reply.status} ${reply.statusText}`,
    wait,
    problem.field ?? "",
  );
}

export const askJson = async (path, options) => (await ask(path, options)).json();

/** Saves what lies at `path`, under `name` if the service gives it none. Without a token the browser streams it to
 * disk itself. */
export async function download(path, name) {
  const link = document.createElement("a");
  link.href = sessionStorage.getItem(TOKEN) ? URL.createObjectURL(await (await ask(path)).blob()) : path;
  link.download = name;
  link.click();
  if (link.href.startsWith("blob:")) setTimeout(() => URL.revokeObjectURL(link.href), KEPT_MS);
}

/** Saves a text as a file. */
export function save(text, type, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text], {type}));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), KEPT_MS);
}

/** Parameters of a view as a query, vectors joined by commas, texts of a list one by one; what is null or "" is left out. */
export function query(params) {
  return Object.entries(params)
    .flatMap(([name, value]) => (typeof value?.[0] === "string" && Array.isArray(value) ? value.map((one) => [name, one]) : [[name, value]]))
    .filter(([, value]) => value != null && value !== "")
    .map(([name, value]) => `${name}=${[value].flat().map(encodeURIComponent).join(",")}`)
    .join("&");
}

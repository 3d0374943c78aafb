// Turns: all pages of a browser share six connections to the service, and a stop must always find one of them free.
// So its pages together read over two at most, and reload one after the other, the ones that are seen at once.
const READERS = 2;
const STOPPING_MS = 200;
const locks = navigator.locks;  // absent on pages from another host without TLS: there each page reads as it likes

/** Does `work` when one of the browser's turns for reading is free. */
export function inTurn(work, signal = null) {
  if (!locks) return work();
  return locks.request(`bench-read-${Math.floor(Math.random() * READERS)}`, signal ? { signal } : {}, work);
}

const gone = () => new Promise(() => {});  // a turn that is held until the page is

/** Loads the page anew: a hidden one when somebody looks at it, no two of a browser at the same moment, none while its
 * stop waits for the answer. */
export function reload() {
  if (document.hidden) { document.addEventListener("visibilitychange", reload, { once: true }); return; }
  if (document.querySelector("form.stop [aria-busy]")) { setTimeout(reload, STOPPING_MS); return; }
  if (!locks) { location.reload(); return; }
  locks.request("bench-reload", () => { location.reload(); return gone(); });
}

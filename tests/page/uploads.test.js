// Uploads against a connection that reads what a viewer would read.

import assert from "node:assert/strict";
import test from "node:test";

import {Uploads} from "../../python/isospline/viewer/page/uploads.js";

// An app that keeps the messages and the bytes in the order in which they are sent.
function appWith(sent) {
  const notes = [], socket = {readyState: 1, bufferedAmount: 0, send: part => sent.push([...new Uint8Array(part)])};
  return {socket, notes, send: message => sent.push(message.files.map(each => each.name).join()), tell() {}, note: text => notes.push(text)};
}

const file = (name, ...bytes) => new File([new Uint8Array(bytes)], name);
globalThis.WebSocket ??= /** @type {any} */ ({OPEN: 1});

test("files that are dropped during an upload follow it", async () => {
  const sent = [], app = appWith(sent), uploads = new Uploads(app);
  uploads.add([file("a", 1, 2)]);
  uploads.add([]);
  uploads.add([file("b", 3), file("c", 4)]);
  await uploads.last;
  assert.deepEqual(sent, ["a", [1, 2], "b,c", [3], [4]]);
  assert.deepEqual(app.notes, []);
});

test("a file that cannot be read, or a lost connection, is told, and the next upload follows", async () => {
  const sent = [], app = appWith(sent), uploads = new Uploads(app);
  const gone = {name: "gone", size: 3, slice: () => ({arrayBuffer: () => Promise.reject(new Error("the file has changed"))})};
  uploads.add([gone]);
  await uploads.add([file("a", 1)]);
  app.socket.readyState = 3;
  await uploads.add([file("b", 2)]);
  assert.deepEqual(sent, ["gone", "a", [1]]);
  assert.deepEqual(app.notes, ["Not opened: gone: the file has changed. Open it again.", "Not opened: b: the connection was lost. Open it again."]);
});

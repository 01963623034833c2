// Files on their way to the viewer, one upload after the other: their bytes have no number.

const PART = 1 << 20, MOST_BUFFERED = 1 << 23; // bytes

export class Uploads {
  /** @param {import("./main.js").App} app */
  constructor(app) {
    this.app = app;
    this.last = Promise.resolve(); // ends with the newest upload
  }

  // Upload files that belong together, after those of before.
  add(files) {
    const all = [...files];
    if (all.length) this.last = this.last.then(() => this.upload(all)).catch(error => this.failed(all, error.message));
    return this.last;
  }

  async upload(files) {
    const {socket} = this.app;
    if (socket.readyState !== WebSocket.OPEN) throw new Error("the connection was lost");
    this.app.send({type: "upload", files: files.map(file => ({name: file.name, size: file.size}))});
    for (const file of files) {
      for (let start = 0; start < file.size; start += PART) {
        const part = await file.slice(start, start + PART).arrayBuffer();
        while (socket.bufferedAmount > MOST_BUFFERED) await new Promise(done => setTimeout(done, 10));
        if (socket.readyState !== WebSocket.OPEN) throw new Error("the connection was lost");
        socket.send(part);
      }
    }
  }

  failed(files, reason) {
    this.app.tell("progress", {title: null});
    this.app.note(`Not opened: ${files.map(file => file.name).join(", ")}: ${reason}. Open it again.`);
  }
}

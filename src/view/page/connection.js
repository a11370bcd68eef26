// The socket to gart: messages as objects, frames as header and JPEG. Connects again when it is lost.

const firstWait = 500, longestWait = 8000;  // milliseconds

const replaced = 1013;  // the code of a close: another page has the place of this one

// `on` has closed(seconds, why), ended(why), frame(header, jpeg), image(header, png), and a function for each type of
// message.
export function connect(on) {
  const address = new URL('socket', location.href);
  address.protocol = address.protocol === 'https:' ? 'wss:' : 'ws:';
  let socket = null, wait = firstWait, ended = false, timer = 0;

  function open() {
    clearTimeout(timer);
    socket = new WebSocket(address, 'gart-view');
    socket.binaryType = 'arraybuffer';
    socket.onmessage = ({data}) => (typeof data === 'string' ? message(JSON.parse(data)) : frame(data));
    socket.onclose = ({code, reason}) => {
      if (ended) return;
      if (code === replaced) return on.ended(reason);
      on.closed(wait / 1000, reason || (code === 1006 ? '' : `code ${code}`));
      timer = setTimeout(open, wait);
      wait = Math.min(longestWait, 2 * wait);
    };
  }

  function message(m) {
    if (m.type === 'hello') wait = firstWait;
    if (m.type === 'bye') ended = true, on.ended(m.why);
    else on[m.type]?.(m);
  }

  function frame(data) {
    const length = new DataView(data).getUint32(0, true);
    const header = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
    const blob = (type) => new Blob([new Uint8Array(data, 4 + length)], {type});
    if (header.type === 'image') on.image({...header, file: blob('image/png')});
    else on.frame(header, blob('image/jpeg'));
  }

  open();
  return {
    send(object) {
      if (socket.readyState !== WebSocket.OPEN) return false;
      socket.send(JSON.stringify(object));
      return true;
    },
    // Messages that have not left yet: a slow line is not given more of them.
    waiting: () => socket.bufferedAmount,
    again() {
      ended = false, wait = firstWait;
      if (socket.readyState >= WebSocket.CLOSING) open();
    },
  };
}

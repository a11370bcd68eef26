// Questions to gart that it answers by their number.

export function questions(send) {
  const open = new Map();
  let last = 0;
  const end = (id, how, what) => {
    const one = open.get(id);
    if (!one) return;
    clearTimeout(one.late);
    open.delete(id);
    one[how](what);
  };
  const fail = (id, why) => end(id, 'reject', new Error(why));
  return {
    ask: (question, seconds) => new Promise((resolve, reject) => {
      const id = ++last;
      if (!send({...question, id})) return reject(new Error('There is no connection.'));
      open.set(id, {resolve, reject, late: setTimeout(() => fail(id, 'gart did not answer.'), 1000 * seconds)});
    }),
    answer: (message) => end(message.id, 'resolve', message),
    failed: ({id, what}) => fail(id, what),
    lost: () => [...open.keys()].forEach((id) => fail(id, 'The connection is lost.')),
  };
}

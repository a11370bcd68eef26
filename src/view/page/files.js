// Hands a file to the reader of the page.

export function saveFile(name, content) {
  const blob = content instanceof Blob ? content : new Blob([JSON.stringify(content, null, 1) + '\n'], {type: 'application/json'});
  const link = Object.assign(document.createElement('a'), {href: URL.createObjectURL(blob), download: name});
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

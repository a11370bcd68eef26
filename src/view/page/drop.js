// Meshes and images of light that are dropped on the view, or chosen as files, go to gart to be added to the scene.

const mostBytes = 64 << 20, endings = /\.(glb|obj|ply|hdr|exr)$/i;

// takes(): why no file is taken, or nothing.
export function fileDrop(stage, input, takes, say) {
  async function send(file) {
    const why = takes() || (endings.test(file.name) ? '' : 'a scene takes .glb, .obj and .ply meshes and .hdr and .exr images') ||
      (file.size > mostBytes ? `the file is larger than ${mostBytes >> 20} MiB` : '');
    if (why) return say(`${file.name}: ${why}.`);
    say(`Sending ${file.name} …`);
    try {
      const answer = await fetch(`add/${encodeURIComponent(file.name)}`, {method: 'POST', body: file});
      if (!answer.ok) say(`${file.name}: ${(await answer.text()).trim()}.`);
    } catch {
      say(`${file.name} could not be sent: there is no connection.`);
    }
  }
  const all = async (files) => {
    for (const file of files) await send(file);
  };
  input.addEventListener('change', async () => {
    await all([...input.files]);
    input.value = '';
  });
  const over = (is) => stage.classList.toggle('dropping', is);
  stage.addEventListener('dragover', (event) => {
    event.preventDefault();
    over(true);
  });
  stage.addEventListener('dragleave', () => over(false));
  stage.addEventListener('drop', (event) => {
    event.preventDefault();
    over(false);
    all([...event.dataTransfer.files]);
  });
}

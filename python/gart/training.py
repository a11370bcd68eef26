"""A whole run, over Session."""
import os

from . import _gart


def train(dataset, options=None, *, start=None, resume=None, checkpoint=None, checkpoint_every=1000, progress=None,
          progress_every=100, **request):
    """Trains a model and returns its Session.

    dataset           a Dataset, or the path of one
    options           TrainOptions; None: the library's defaults
    start             a Model to begin with
    resume            a checkpoint to go on from
    checkpoint        where to write checkpoints, every ``checkpoint_every`` steps and at the end
    progress          called as progress(report) every ``progress_every`` steps and after the last; False ends the run
    request           backend, tracer, threads and the like, as of Renderer
    """
    if isinstance(dataset, (str, os.PathLike)):
        dataset = _gart.load_dataset(dataset)
    options = options or _gart.TrainOptions()
    session = _gart.Session(dataset, options, start, **request)
    if resume is not None:
        session.load(resume)
    while session.steps_done < options.iterations:
        report = session.step()
        last = report.step >= options.iterations
        if checkpoint is not None and (last or report.step % checkpoint_every == 0):
            session.save(checkpoint)
        if progress is not None and (last or report.step % progress_every == 0) and progress(report) is False:
            break
    return session

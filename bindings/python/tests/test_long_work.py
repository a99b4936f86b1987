"""Progress, cancellation, Ctrl-C, exceptions and threads."""

import _thread
import signal
import threading

import marrow
import numpy as np
import pytest


@pytest.fixture(scope="module")
def noise():
    """A volume whose extraction and reduction take a while."""
    return np.random.default_rng(1).integers(0, 1000, (90, 90, 90), np.int16)


@pytest.fixture(scope="module")
def rough(noise):
    return marrow.extract(noise[:40, :40, :40], 500.5)


class Stop(Exception):
    pass


def test_progress_rises_to_one(noise):
    fractions = []
    marrow.extract(noise, 500.5, progress=fractions.append)
    assert fractions == sorted(fractions)
    assert 0 <= fractions[0] and fractions[-1] == 1


def test_false_cancels_before_work_starts(ball):
    for _ in range(100):  # work that is over before the next report
        with pytest.raises(marrow.Cancelled):
            marrow.extract(ball[:3, :3, :3], -999.5, progress=lambda fraction: False)


def test_false_cancels_work_that_has_started(rough):
    answers = [True, False]
    with pytest.raises(marrow.Cancelled):
        rough.simplify(100, progress=lambda fraction: answers.pop(0))
    assert not answers


def test_none_and_true_do_not_cancel(noise):
    assert len(marrow.extract(noise, 500.5, progress=lambda fraction: None).points)
    assert len(marrow.extract(noise, 500.5, progress=lambda fraction: True).points)


def test_an_exception_of_the_callback_arrives(rough):
    calls = []

    def fail(fraction):
        calls.append(fraction)
        raise Stop("here")

    with pytest.raises(Stop, match="here"):
        rough.simplify(100, progress=fail)
    assert len(calls) == 1


def test_an_extractor_goes_on_after_a_cancelled_call(noise):
    extractor = marrow.IsosurfaceExtractor(noise)
    with pytest.raises(Stop):
        extractor.extract(500.5, progress=raise_stop_after_start())
    assert np.array_equal(extractor.extract(500.5).points, marrow.extract(noise, 500.5).points)


def raise_stop_after_start():
    fractions = []

    def progress(fraction):
        fractions.append(fraction)
        if len(fractions) > 1:
            raise Stop

    return progress


def test_ctrl_c_arrives(rough):
    threading.Timer(0.2, _thread.interrupt_main).start()
    with pytest.raises(KeyboardInterrupt):
        for _ in range(1000):
            rough.simplify(100)


def test_a_signal_handler_runs_meanwhile(rough):
    handled = []
    old = signal.signal(signal.SIGALRM, lambda number, frame: handled.append(number))
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.05)
        at_call = []
        while not handled:
            rough.simplify(100, progress=lambda fraction: at_call.append(len(handled)))
        assert 1 in at_call  # handled before the work was done
    finally:
        signal.signal(signal.SIGALRM, old)


def test_other_threads_go_on_meanwhile(rough):
    counts, stop = [0], threading.Event()

    def count():
        while not stop.wait(0.001):
            counts[0] += 1

    during = []
    thread = threading.Thread(target=count)
    thread.start()
    try:
        rough.simplify(100, progress=lambda fraction: during.append(counts[0]))
    finally:
        stop.set()
        thread.join()
    assert during[-1] > during[0] + 3


def run_in_threads(function, count=4):
    results, errors = [None] * count, []

    def run(index):
        try:
            results[index] = function(index)
        except BaseException as error:
            errors.append(error)

    threads = [threading.Thread(target=run, args=(index,)) for index in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not errors
    return results


def test_four_threads_extract_at_once(noise):
    expected = [marrow.extract(noise, 100.5 + 200 * index) for index in range(4)]
    for index, mesh in enumerate(run_in_threads(lambda index: marrow.extract(noise, 100.5 + 200 * index))):
        assert np.array_equal(mesh.points, expected[index].points)
        assert np.array_equal(mesh.triangles, expected[index].triangles)


def test_four_threads_share_an_extractor(ball):
    extractor = marrow.IsosurfaceExtractor(ball)
    isovalues = [-999.5, -99.5, 300.5, 800.5]
    expected = [marrow.extract(ball, isovalue).points for isovalue in isovalues]

    def extract_many(index):
        return [extractor.extract(isovalues[(index + k) % 4]).points for k in range(20)]

    for index, found in enumerate(run_in_threads(extract_many)):
        for k, points in enumerate(found):
            assert np.array_equal(points, expected[(index + k) % 4])


def test_a_call_that_waits_for_its_turn_can_be_cancelled(noise):
    extractor = marrow.IsosurfaceExtractor(noise)
    running, release = threading.Event(), threading.Event()

    def hold(fraction):
        running.set()
        release.wait()

    # The callback holds up only the thread that called, so the extraction ends meanwhile: another one must follow.
    def extract_until_released():
        while not release.is_set():
            extractor.extract(500.5, progress=hold)

    holder = threading.Thread(target=extract_until_released)
    holder.start()
    running.wait()
    try:
        with pytest.raises(Stop):
            extractor.extract(500.5, progress=raise_stop_after_start())
    finally:
        release.set()
        holder.join()


def test_a_callback_may_extract(noise, ball):
    inner = []
    marrow.extract(noise, 500.5, progress=lambda fraction: inner.append(len(marrow.extract(ball, 300.5).points)))
    assert inner and set(inner) == {len(marrow.extract(ball, 300.5).points)}

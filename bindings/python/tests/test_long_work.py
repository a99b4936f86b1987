"""Progress, cancellation, Ctrl-C, exceptions and threads."""

import _thread
import signal
import sys
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


@pytest.fixture
def meanwhile():
    """Calls functions on another thread, once this one next gives up the interpreter's lock.

    Python does not take the lock from a thread within this test, so that the function runs during long work.
    """
    threads = []

    def start(function):
        may_run = threading.Event()

        def run():
            may_run.wait()
            function()

        threads.append(threading.Thread(target=run))
        threads[-1].start()
        may_run.set()

    interval = sys.getswitchinterval()
    sys.setswitchinterval(1000)
    try:
        yield start
    finally:
        sys.setswitchinterval(interval)
        for thread in threads:
            thread.join()


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


@pytest.mark.parametrize("false", [False, np.False_])
def test_false_cancels_work_that_has_started(rough, false):
    answers = [True, false]
    with pytest.raises(marrow.Cancelled):
        rough.simplify(100, progress=lambda fraction: answers.pop(0))
    assert not answers


@pytest.mark.parametrize("answer", [None, True, np.True_, 0, 0.0])
def test_other_answers_do_not_cancel(noise, answer):
    assert len(marrow.extract(noise, 500.5, progress=lambda fraction: answer).points)


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


def test_ctrl_c_ends_the_call(rough, meanwhile):
    sent, ended = [], []

    def interrupt():
        sent.append(True)
        _thread.interrupt_main()

    with pytest.raises(KeyboardInterrupt):
        meanwhile(interrupt)
        while not ended:
            rough.simplify(100)
            ended += sent
    assert not ended  # or the interrupt waited for the end of the call


def test_a_signal_handler_runs_meanwhile(rough, meanwhile):
    handled = []
    old = signal.signal(signal.SIGALRM, lambda number, frame: handled.append(number))
    try:
        meanwhile(lambda: signal.pthread_kill(threading.main_thread().ident, signal.SIGALRM))
        at_call = []
        while not handled:
            rough.simplify(100, progress=lambda fraction: at_call.append(len(handled)))
        assert 1 in at_call  # handled before the work was done
    finally:
        signal.signal(signal.SIGALRM, old)


@pytest.mark.parametrize("work", ["simplify", "near"])
def test_other_threads_go_on_meanwhile(noise, rough, meanwhile, work):
    walls = marrow.find_thin_walls(noise[:40, :40, :40], 500.5, rough)
    call = {"simplify": lambda: rough.simplify(100), "near": lambda: walls.near(rough)}[work]
    counts, stop = [0], threading.Event()

    def count():
        while not stop.wait(0.001):
            counts[0] += 1

    meanwhile(count)
    try:
        before = counts[0]
        for _ in range(100):
            call()
            if counts[0] > before + 3:
                break
        assert counts[0] > before + 3
    finally:
        stop.set()


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


def test_a_call_can_be_cancelled_while_others_use_the_extractor(noise):
    extractor = marrow.IsosurfaceExtractor(noise)
    running, release = threading.Barrier(4), threading.Event()

    # One works while the others wait for their turn, so that the extractor is always busy.
    def extract_until_released():
        running.wait()
        while not release.is_set():
            extractor.extract(500.5)

    holders = [threading.Thread(target=extract_until_released) for _ in range(3)]
    for holder in holders:
        holder.start()
    running.wait()
    try:
        with pytest.raises(Stop):
            extractor.extract(500.5, progress=raise_stop_after_start())
    finally:
        release.set()
        for holder in holders:
            holder.join()


def test_a_callback_may_extract(noise, ball):
    inner = []
    marrow.extract(noise, 500.5, progress=lambda fraction: inner.append(len(marrow.extract(ball, 300.5).points)))
    assert inner and set(inner) == {len(marrow.extract(ball, 300.5).points)}

"""The stop channel: words that need no free byte, no free inode and no database, and what becomes of them."""

import os
import shutil
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from threading import Thread

import pytest

from bench_service.bench.records_in_place import RECORD_BYTES
from bench_service.bench.stop.channel import SUPERVISOR, WORDS, WORKER, StopChannel
from bench_service.bench.stop.word import DAMAGED, StopAnswer, StopWord


@pytest.fixture
def channel(tmp_path: Path) -> StopChannel:
    made = StopChannel(tmp_path, "sim")
    made.prepare()
    return made


def other(channel: StopChannel) -> StopChannel:
    """The same channel as another process has it."""
    return StopChannel(channel._folder, channel.bench_id)


def test_a_word_goes_from_asked_over_seen_to_safe_and_its_release_takes_it_away(channel: StopChannel) -> None:
    word = StopWord("Hände im Prüfstand", "Olena", "http")
    assert channel.ask(word)
    theirs = other(channel)
    assert theirs.standing() == (word,)
    assert channel.state(word.id) == "asked"
    theirs.answer(SUPERVISOR, StopAnswer("the supervisor", frozenset({word.id})))
    assert channel.state(word.id) == "seen"
    theirs.answer(WORKER, StopAnswer("the worker", frozenset({word.id}), frozenset({word.id})))
    assert channel.state(word.id) == "safe"
    theirs.mark_booked([word.id])
    assert [one.booked for one in channel.standing()] == [True]
    channel.clear([word.id])
    assert theirs.standing() == ()


@pytest.mark.parametrize("letter", ["x", "я", "\x1b", "\udc80", "😀"])
def test_the_longest_texts_fit_whatever_they_are_made_of(channel: StopChannel, letter: str) -> None:
    word = StopWord(letter * 5000, letter * 5000, "http")
    assert channel.ask(word)
    (found,) = other(channel).standing()
    shown = "\\udc80" if letter == "\udc80" else letter  # no database takes it as it is
    assert (found.reason, found.by) == ((shown * 500)[:500], (shown * 500)[:100])


def test_words_asked_at_once_are_all_kept_and_one_too_many_leaves_the_bench_stopped(channel: StopChannel) -> None:
    words = [StopWord(f"reason {number}", "somebody", "http") for number in range(WORDS)]
    threads = [Thread(target=lambda word=word: other(channel).ask(word)) for word in words]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert {word.id for word in channel.standing()} == {word.id for word in words}
    assert channel.ask(StopWord("one more", "somebody", "http"))
    assert len(channel.standing()) == WORDS


def test_a_stop_beyond_the_room_of_the_file_is_answered_and_stands_after_the_others(channel: StopChannel) -> None:
    """The 17th was dropped: nobody answered it, and it did not stand once the others were released."""
    words = [StopWord(f"reason {number}", "somebody", "http") for number in range(WORDS)]
    for word in words:
        channel.ask(word)
    worker, asking = other(channel), other(channel)
    listening = worker.listen(WORKER)
    assert listening is not None
    late = [StopWord(f"late {number}", "Olena", "command") for number in range(WORDS)]
    for word in late:
        assert asking.ask(word)
        worker.receive(listening)
    listening.close()
    assert {asking.state(word.id) for word in late} == {"asked"}
    ids = frozenset(word.id for word in worker.standing())
    assert ids == {word.id for word in (*words, *late)}
    worker.answer(WORKER, StopAnswer("the worker", ids))
    assert {asking.state(word.id) for word in late} == {"seen"}
    worker.answer(WORKER, StopAnswer("the worker", ids, ids))
    assert {asking.state(word.id) for word in late} == {"safe"}
    worker.clear(word.id for word in words)
    assert {word.id for word in worker.standing()} == {word.id for word in late}


def test_a_stop_in_memory_stands_also_while_it_is_marked(channel: StopChannel) -> None:
    """The stop guard's thread reads it while another one exchanges stops with the database."""
    for number in range(WORDS):
        channel.ask(StopWord(f"reason {number}", "somebody", "http"))
    channel._take(late := StopWord("late", "Olena", "command"))
    standing: list[bool] = []

    def looked(word: StopWord) -> StopWord:
        standing.append(late.id in {one.id for one in channel.standing()})
        return replace(word, booked=True)

    channel._change([late.id], looked)
    assert standing == [True]
    assert [one.booked for one in channel.standing() if one.id == late.id] == [True]


def test_a_stop_that_no_process_keeps_is_as_far_as_the_least_of_those_that_stand(channel: StopChannel) -> None:
    words = [StopWord(f"reason {number}", "somebody", "http") for number in range(WORDS)]
    for word in words:
        channel.ask(word)
    assert channel.ask(one_more := StopWord("one more", "Olena", "command"))
    first, ids = words[0].id, frozenset(word.id for word in words)
    for seen, safe, state in (
        (ids - {first}, (), "asked"),
        (ids, (), "seen"),
        (ids, {first}, "seen"),
        (ids, ids, "safe"),
    ):
        other(channel).answer(WORKER, StopAnswer("the worker", frozenset(seen), frozenset(safe)))
        assert channel.state(one_more.id) == state
    assert channel.state("another") == "asked"


def test_a_torn_record_stops_the_bench_until_it_is_released(channel: StopChannel) -> None:
    channel.ask(StopWord("a test", "somebody", "http"))
    with (channel._folder / "bench-sim.stop").open("r+b") as file:
        file.seek(2 * RECORD_BYTES)
        file.write(b"xxxxxxxx")
    assert [word.id for word in other(channel).standing()] == [DAMAGED.id]
    channel.clear([DAMAGED.id])
    assert other(channel).standing() == ()


def test_a_full_disk_without_a_free_inode_takes_a_stop(small_disk: Path) -> None:
    channel = StopChannel(small_disk, "sim")
    channel.prepare()
    with (small_disk / "ballast").open("ab", buffering=0) as file:
        file.write(b"\0" * shutil.disk_usage(small_disk).free)
    with pytest.raises(OSError, match="No space left"):
        (small_disk / "one byte").write_bytes(b"x")
    word = StopWord("smoke", "Olena", "command")
    assert channel.ask(word)
    assert other(channel).standing() == (word,)


def test_where_the_file_cannot_be_written_the_socket_carries_the_word(tmp_path: Path) -> None:
    """A file system that copies on write behaves so when it is full: here there is no file at all."""
    worker, asking = StopChannel(tmp_path, "sim"), StopChannel(tmp_path, "sim")
    listening = worker.listen(WORKER)
    assert listening is not None
    word = StopWord("smoke", "Olena", "command")
    assert asking.ask(word)
    assert not worker.receive(listening)
    assert worker.standing() == (word,)
    assert asking.wake()
    assert worker.receive(listening)
    listening.close()
    assert not asking.ask(StopWord("nobody is there", "Olena", "command"))


def test_a_long_path_and_a_socket_that_a_dead_process_left_are_no_obstacle(tmp_path: Path) -> None:
    folder = tmp_path / ("long-" * 30)
    folder.mkdir()
    dead = StopChannel(folder, "sim").listen(WORKER)
    assert dead is not None
    dead.close()
    channel = StopChannel(folder, "sim")
    channel.prepare()
    listening = channel.listen(WORKER)
    assert listening is not None
    assert StopChannel(folder, "sim").wake()
    assert channel.receive(listening)
    listening.close()


def test_what_is_no_stop_is_not_taken_for_one(channel: StopChannel) -> None:
    listening = channel.listen(WORKER)
    assert listening is not None
    for message in (b"", b"{", b"[]", b'{"stop": 1}', b'{"stop": {"id": "x"}}'):
        with channel.listen(SUPERVISOR) or listening as sender:
            sender.sendto(message, str(channel._folder / "bench-sim.stop-worker"))
    assert not channel.receive(listening)
    assert channel.standing() == ()
    listening.close()


def test_a_writer_that_was_stopped_with_the_lock_holds_nobody_up(channel: StopChannel) -> None:
    import fcntl

    held = os.open(channel._folder / "bench-sim.stop", os.O_RDWR)
    fcntl.flock(held, fcntl.LOCK_EX)
    try:
        word = StopWord("smoke", "Olena", "command", at=datetime.now(UTC))
        assert other(channel).ask(word)
        assert channel.standing() == (word,)
    finally:
        os.close(held)

"""check_image.py: what must not be in an image is found, and the stack is that of the longest path."""

from tools.checks import check_image
from tools.checks.check_image import CallGraph, read_functions

LISTING = """
00000100 <start_reset>:
     100:\tpush\t{r4, lr}
     102:\tsub\tsp, #24
     104:\tbl\t200 <middle>
     108:\tb.n\t104 <start_reset+0x4>

00000200 <middle>:
     200:\tstmdb\tsp!, {r4, r5, r6, r7, r8, r9, lr}
     204:\tvpush\t{d8-d9}
     208:\tsub.w\tsp, sp, #400\t@ 0x190
     20c:\tbl\t300 <leaf>
     210:\tb.w\t400 <tail>

00000300 <leaf>:
     300:\tstr.w\tlr, [sp, #-4]!
     304:\tbx\tlr

10000400 <far>:
10000400:\tbx\tlr

00000400 <tail>:
     400:\tpush\t{r4}
     402:\tpop\t{r3}
     404:\tbx\tr3
"""


def test_stack_is_that_of_the_longest_path():
    graph = CallGraph(read_functions(LISTING), {})
    assert graph.deepest("start_reset") == (8 + 24 + 28 + 16 + 400 + 4, ["start_reset", "middle", "tail"])
    assert graph.faults == []


def test_frames_of_the_compiler_win():
    graph = CallGraph(read_functions(LISTING), {"middle": 1000, "leaf": 8})
    assert graph.deepest("start_reset") == (32 + 1000 + 8, ["start_reset", "middle", "leaf"])


def test_recursion_is_found_through_any_number_of_functions():
    listing = LISTING.replace("304:\tbx\tlr", "304:\tbl\t200 <middle>")
    graph = CallGraph(read_functions(listing), {})
    graph.deepest("start_reset")
    assert graph.faults == ["recursion: middle > leaf > middle"]


def test_a_function_that_calls_itself_is_found():
    listing = LISTING.replace("304:\tbx\tlr", "304:\tbl\t300 <leaf>")
    graph = CallGraph(read_functions(listing), {})
    graph.deepest("start_reset")
    assert graph.faults == ["recursion: leaf > leaf"]


def test_a_call_through_a_pointer_needs_a_name():
    graph = CallGraph(read_functions(LISTING.replace("304:\tbx\tlr", "304:\tblx\tr3")), {})
    assert graph.faults == ["leaf calls through a pointer: whom? check_image.py, CALLED_BY_POINTER"]


def test_a_call_through_a_pointer_goes_to_all_it_may(monkeypatch):
    monkeypatch.setattr(check_image, "CALLED_BY_POINTER", (("leaf", "tail|far"),))
    graph = CallGraph(read_functions(LISTING.replace("304:\tbx\tlr", "304:\tblx\tr3")), {"tail": 52})
    assert graph.deepest("leaf") == (4 + 52, ["leaf", "tail"])


def test_doubles_heap_and_printf_are_found():
    listing = "__aeabi_dmul T 100 4\nmalloc T 200 4\nsnprintf t 1 1\n__ieee754_fmodf T 4 4\nbslam_x T 4 4\n"
    found = [line.split()[0] for line in check_image.unwanted(listing)]
    assert found == ["__aeabi_dmul", "malloc", "snprintf"]


def test_stack_room_is_between_its_symbols():
    listing = "start_stack_bottom B 20000000 0\nstart_stack_top B 20001000 0\n"
    assert check_image.stack_room(listing) == 4096

"""Records exactly as devices send them."""

from __future__ import annotations

import json
import math

import pytest

from clients.bridge.asl import ANSWER_NS, Asl, pack, unpack
from clients.bridge.codec import Codec
from clients.bridge.csv_lines import CsvLines
from clients.bridge.errors import ConfigError
from clients.bridge.eyetribe import HEARTBEAT, EyeTribe
from clients.bridge.gazepoint import Gazepoint
from clients.bridge.iscan import IscanAscii, IscanBinary
from clients.bridge.json_lines import JsonLines
from clients.bridge.pattern_lines import PatternLines
from clients.bridge.sample import Eye, Point, Sample, gaze_of, seen
from clients.bridge.smi import HOPELESS_LINES, Smi

# SMI

RED_M = (
    "ET_SPL 100527771763 b 788 788 258 258 12.105186 10.957320 12.105186 10.957320 -59.875  3.226 14.819 17.609 "
    "586.966 580.848 379.807800 654.019907 438.804785 425.142153 3.09 2.82 3",
    "ET_SPL 102172364740 b 855 855 346 346 13.103793 11.830818 13.103793 11.830818 -66.588 -2.985 18.302 11.463 "
    "582.493 574.155 346.478830 623.560946 432.144375 461.448565",
    "ET_SPL 91555722812 b 420 420 564 564 17.219431 17.855097 17.219431 17.855097 -53.704  9.674 13.589 15.935 "
    "624.140 612.472 419.313368 680.213202 455.167761 443.716013 4.72 4.72 3",
)
ASKED = (
    "ET_SPL b 100527788 790 790 255 255 -59.923  3.225 14.816 17.588 587.446 580.656",
    "ET_SPL b 100527796 790 790 253 253 -59.940  3.229 14.812 17.578 587.647 580.575",
    "ET_SPL b 100527805 790 790 252 252 -59.955  3.232 14.814 17.569 587.825 580.504",
    "ET_SPL b 100527813 790 790 251 251 -59.967  3.237 14.815 17.566 587.983 580.440",
    "ET_SPL b 100527821 789 789 250 250 -59.974  3.244 14.816 17.565 588.123 580.384",
)
ASKED_FORMAT = "%ET %TS %SX %SY %EX %EY %EZ"


def feed_lines(codec: Codec, *lines: str) -> list[Sample]:
    return codec.feed("".join(line + "\r\n" for line in lines).encode("ascii"))


def test_smi_reads_the_format_that_was_set() -> None:
    samples = feed_lines(Smi(ASKED_FORMAT), *ASKED)
    assert [sample.ticks for sample in samples] == [100527788, 100527796, 100527805, 100527813, 100527821]
    assert [sample.left for sample in samples] == [(790, 255), (790, 253), (790, 252), (790, 251), (789, 250)]
    assert [sample.right for sample in samples] == [sample.left for sample in samples]


@pytest.mark.parametrize(
    ("line", "ticks", "point"),
    [
        (RED_M[0], 100527771763, (788, 258)),
        (RED_M[1], 102172364740, (855, 346)),
        (RED_M[2], 91555722812, (420, 564)),
    ],
)
def test_smi_reads_a_servers_own_format_by_the_eye_letter(line: str, ticks: float, point: tuple[float, float]) -> None:
    (sample,) = feed_lines(Smi(), line)
    assert (sample.ticks, sample.left, sample.right) == (ticks, point, point)


def test_smi_reads_left_and_right_apart() -> None:
    (sample,) = feed_lines(Smi("%ET %SX %SY"), "ET_SPL b 399 398 200 199")
    assert sample[2:] == (None, (399, 200), (398, 199), None)
    assert gaze_of(sample, Eye.AVERAGE) == (398.5, 199.5)


def test_smi_reads_separators_of_the_users_choice() -> None:
    (sample,) = feed_lines(Smi("%TS: %SX, %SY"), "ET_SPL 28437864110: 400, 202")
    assert (sample.ticks, sample.both) == (28437864110, (400, 202))
    (sample,) = feed_lines(Smi("y=%SY x=%SX"), "ET_SPL y=202 201 x=400 401")
    assert (sample.left, sample.right) == ((400, 202), (401, 201))


def test_smi_reads_one_eye() -> None:
    left, right = feed_lines(Smi(), "ET_SPL 10 l 400 202", "ET_SPL 18 r -3 1090")
    assert (left.left, left.right, right.left, right.right) == ((400, 202), None, None, (-3, 1090))


def test_smi_takes_zeros_for_a_lost_eye() -> None:
    one, none = feed_lines(Smi(), "ET_SPL 10 b 400 0 202 0", "ET_SPL 18 b 0 0 0 0")
    assert (one.left, one.right) == ((400, 202), None)
    assert gaze_of(one, Eye.BEST) == (400, 202)
    assert gaze_of(one, Eye.AVERAGE) is None
    assert gaze_of(none, Eye.BEST) is None


def test_smi_finds_a_line_behind_garbage_and_ignores_what_it_does_not_know() -> None:
    codec = Smi(ASKED_FORMAT)
    samples = feed_lines(
        codec,
        'ET_FRM "%ET %TS %SX %SY %EX %EY %EZ"',
        "in:???? in:" + ASKED[1],
        "ET_CHG 1",
        "ET_PNT 1 640 512",
        "ET_LEV 2",
        "ET_FIX l 100527805 790.5 252.1",
        "ET_NEW something",
        ASKED[2][:30] + ASKED[3],
    )
    assert [sample.ticks for sample in samples] == [100527796, 100527813]
    assert codec.bad == 0


def test_smi_keeps_to_the_width_that_lines_have() -> None:
    """A line that lost columns has its gaze where it was, but perhaps not whole."""
    codec = Smi()
    assert len(feed_lines(codec, RED_M[0], RED_M[0][:40], RED_M[0])) == 2
    assert codec.bad == 1
    assert len(feed_lines(codec, *[RED_M[1]] * 4)) == 2


def test_smi_refuses_a_format_without_an_eye_letter_and_says_so() -> None:
    codec = Smi()
    assert feed_lines(codec, *["ET_SPL 1 2 3 4 5 6 7"] * HOPELESS_LINES) == []
    assert codec.complaint is not None
    assert 'expected lines "ET_SPL %TS %ET %SX %SY", found "ET_SPL 1 2 3 4 5 6 7"' in codec.complaint
    assert len(feed_lines(codec, "ET_SPL 10 l 400 202")) == 1
    assert codec.complaint is None


def test_smi_commands() -> None:
    assert Smi().start() == (b'ET_FRM "%TS %ET %SX %SY"\nET_STR\n',)
    assert Smi().stop() == b"ET_EST\n"


@pytest.mark.parametrize("bad", ["%TS %ET", "%SX %SY %QQ", '%SX %SY"', "%SX %SY %SX"])
def test_smi_refuses_other_formats(bad: str) -> None:
    with pytest.raises(ConfigError, match="smi_format"):
        Smi(bad)


# ASL

ASL_8 = [
    ((0, 45, 0, 130, 120), "00002d0000820078", "80002d00000200207800"),
    ((0, 0, 0, 0, 0), "0000000000000000", "80000000000000000000"),
    ((0, 52, 0, -3, 250), "00003400fffd00fa", "800034007f7d00307a01"),
    ((1, 40, 0, 260, 240), "01002800010400f0", "81002800010400007001"),
    ((0, 200, 0, 255, 128), "0000c80000ff0080", "8000480000 7f00240001".replace(" ", "")),
]
ASL_10 = [
    ((0, 1, 45, 0, 130, 120), "800001002d00000002007801"),
    ((0, 65535, 200, 0, -3, 250), "807f7f004800 7f567d007a05".replace(" ", "")),
    ((0, 384, 128, 0, 255, 128), "8001000000000014 7f000005".replace(" ", "")),
]


def expected(status: int, pupil: int, x: int, y: int) -> tuple[float, float] | None:
    return None if status > 0 or pupil == 0 else (x, y)


@pytest.mark.parametrize(("record", "plain", "streamed"), ASL_8)
def test_asl_reads_eight_bytes(record: tuple[int, ...], plain: str, streamed: str) -> None:
    status, pupil, _, x, y = record
    assert pack(bytes.fromhex(plain)).hex() == streamed
    assert unpack(bytes.fromhex(streamed)) == bytes.fromhex(plain)
    assert Asl().feed(bytes.fromhex(streamed)) == [
        Sample(0, 10, both=Point(x, y) if expected(status, pupil, x, y) else None)
    ]
    asked = Asl(request=0x53)
    assert asked.due(0) == b"\x53"
    (sample,) = asked.feed(bytes.fromhex(plain))
    assert sample.both == expected(status, pupil, x, y)


@pytest.mark.parametrize(("record", "streamed"), ASL_10)
def test_asl_reads_ten_bytes_with_the_frame_number(record: tuple[int, ...], streamed: str) -> None:
    status, frame, pupil, _, x, y = record
    (sample,) = Asl(counted=True).feed(bytes.fromhex(streamed))
    assert (sample.ticks, sample.both) == (frame, expected(status, pupil, x, y))
    assert sample.size == 12


def test_asl_refuses_bits_that_no_record_sets() -> None:
    codec = Asl()
    assert codec.feed(bytes.fromhex("80002d00000200207802")) == []
    assert codec.bad == 1


def test_asl_finds_the_next_record_after_each_lost_byte() -> None:
    stream = b"".join(bytes.fromhex(streamed) for _, _, streamed in ASL_8)
    for lost in range(len(stream)):
        assert len(Asl().feed(stream[:lost] + stream[lost + 1 :])) >= 4


def test_asl_asks_again_when_no_answer_comes_and_forgets_half_of_one() -> None:
    codec = Asl(request=1)
    assert codec.due(0) == b"\1"
    assert codec.due(ANSWER_NS - 1) == b""
    assert codec.feed(bytes.fromhex(ASL_8[0][1])[:5]) == []
    assert codec.due(ANSWER_NS) == b"\1"
    assert codec.bad == 1
    (sample,) = codec.feed(bytes.fromhex(ASL_8[2][1]))
    assert sample.both == (-3, 250)
    assert codec.feed(b"\0\0\0") == []
    assert codec.due(ANSWER_NS + 1) == b"\1"
    assert len(codec.feed(bytes.fromhex(ASL_8[0][1]))) == 1


def test_asl_refuses_a_request_that_is_no_byte() -> None:
    with pytest.raises(ConfigError, match="poll_byte"):
        Asl(request=256)


# ISCAN


def test_iscan_reads_binary_packets() -> None:
    (sample,) = IscanBinary().feed(bytes.fromhex("4444f909ff04"))
    assert sample == Sample(0, 6, both=Point(255.3, 127.9))
    (sample,) = IscanBinary().feed(bytes.fromhex("444444090a00"))
    assert sample.both == (237.2, 1.0)


def test_iscan_finds_the_next_packet_after_each_lost_byte() -> None:
    stream = bytes.fromhex("4444f909ff04") * 5
    for lost in range(len(stream)):
        samples = IscanBinary().feed(stream[:lost] + stream[lost + 1 :])
        assert [sample.both for sample in samples] == [(255.3, 127.9)] * 4


def test_iscan_reads_ascii_lines() -> None:
    line = b" 255.3\t 127.9\t\r\n"
    assert len(line) == 16
    assert IscanAscii().feed(line) == [Sample(0, 16, both=Point(255.3, 127.9))]
    (sample,) = IscanAscii(parameters=3, columns=(2, 0)).feed(b"   1.5\t   2.5\t 103.5\t\r\n")
    assert sample.both == (103.5, 1.5)


def test_iscan_takes_zeros_for_a_lost_eye() -> None:
    (sample,) = IscanBinary().feed(bytes.fromhex("444400000000"))
    assert sample.both is None


def test_iscan_commands_are_options() -> None:
    assert (IscanBinary().start(), IscanBinary().stop()) == ((b"\x81", b"\x80"), b"\x81")
    assert IscanAscii(start=132, stop=136).start() == (b"\x88", b"\x84")


@pytest.mark.parametrize(
    "wrong",
    [{"parameters": 1}, {"parameters": 13}, {"columns": (0, 2)}, {"columns": (1, 1)}, {"start": 127}, {"stop": 300}],
)
def test_iscan_refuses_what_is_out_of_range(wrong: dict[str, int]) -> None:
    with pytest.raises(ConfigError, match="iscan_"):
        IscanBinary(**wrong)


# Gazepoint

RECORD = (
    '<REC CNT="43333" TIME="712.77087" TIME_TICK="1155508731205" FPOGX="0.56816" FPOGY="0.39911" FPOGS="712.65570" '
    'FPOGD="0.11517" FPOGID="927" FPOGV="1" LPOGX="0.57369" LPOGY="0.41612" LPOGV="1" RPOGX="0.59129" RPOGY="0.43364" '
    'RPOGV="1" BPOGX="0.58249" BPOGY="0.42488" BPOGV="1" LPCX="0.26159" LPCY="0.46292" LPD="15.62251" LPS="1.04923" '
    'LPV="1" RPCX="0.65861" RPCY="0.44115" RPD="18.38220" RPS="1.05784" RPV="1" LEYEX="-0.17772" LEYEY="0.01077" '
    'LEYEZ="2.73629" LPUPILD="0.00469" LPUPILV="0" REYEX="0.02872" REYEY="0.00517" REYEZ="0.64924" RPUPILD="0.00469" '
    'RPUPILV="1" CX="-0.56823" CY="0.59500" CS="0" USER="STOP=1493309458542" />'
)


def test_gazepoint_reads_a_whole_record() -> None:
    (sample,) = feed_lines(Gazepoint(), RECORD)
    assert sample.ticks == 712.77087
    assert (sample.left, sample.right, sample.both) == ((0.57369, 0.41612), (0.59129, 0.43364), (0.58249, 0.42488))


def test_gazepoint_reads_the_least_record_and_a_gaze_off_the_screen() -> None:
    (sample,) = feed_lines(Gazepoint(), '<REC CNT="237217" BPOGX="0.43388" BPOGY="1.08536" BPOGV="1" />')
    assert sample[2:] == (None, None, None, (0.43388, 1.08536))


def test_gazepoint_reads_newer_firmware_and_blanks_in_user_data() -> None:
    line = (
        '<REC CNT="2220575" TIME="38686.52734" TIME_TICK="4727430607263" FPOGX="0.552604" BPOGX="0.5" BPOGY="0.25" '
        'BPOGV="1" LPMM="6.09139" LPMMV="1" USER="a = b  c,0,1920" />'
    )
    (sample,) = feed_lines(Gazepoint(), line)
    assert (sample.ticks, sample.both) == (38686.52734, (0.5, 0.25))


def test_gazepoint_reads_glued_messages_wherever_they_are_cut() -> None:
    data = b'<ACK ID="ENABLE_SEND_DATA" STATE="1" />\r\n' * 2 + RECORD.encode() + b"\r\n"
    for cut in range(len(data)):
        codec = Gazepoint()
        assert len(codec.feed(data[:cut]) + codec.feed(data[cut:])) == 1
        assert codec.bad == 0


def test_gazepoint_marks_what_is_not_valid() -> None:
    (sample,) = feed_lines(Gazepoint(), RECORD.replace('BPOGV="1"', 'BPOGV="0"').replace('LPOGV="1"', 'LPOGV="0"'))
    assert (sample.left, sample.right, sample.both) == (None, (0.59129, 0.43364), None)


def test_gazepoint_refuses_a_record_without_the_point() -> None:
    codec = Gazepoint()
    assert feed_lines(codec, '<REC CNT="1" FPOGX="0.5" FPOGY="0.5" FPOGV="1" />', RECORD[:-3]) == []
    assert codec.bad == 2


def test_gazepoint_commands() -> None:
    (commands,) = Gazepoint().start()
    assert b'<SET ID="ENABLE_SEND_POG_BEST" STATE="1" />\r\n' in commands
    assert commands.endswith(b'<SET ID="ENABLE_SEND_DATA" STATE="1" />\r\n')
    assert Gazepoint().stop() == b'<SET ID="ENABLE_SEND_DATA" STATE="0" />\r\n'


# The Eye Tribe

LOST_FRAME = (
    '{"category":"tracker","request":"get","statuscode":200,"values":{"frame":{"avg":{"x":0.0,"y":0.0},"fix":false,'
    '"lefteye":{"avg":{"x":3.0,"y":0.0},"pcenter":{"x":0.0,"y":0.0},"psize":0.0,"raw":{"x":0.0,"y":0.0}},'
    '"raw":{"x":0.0,"y":0.0},"righteye":{"avg":{"x":0.0,"y":0.0},"pcenter":{"x":0.0,"y":0.0},"psize":0.0,'
    '"raw":{"x":0.0,"y":0.0}},"state":16,"time":604571264,"timestamp":"2019-09-12 13:53:54.304"}}}'
)


def test_eyetribe_reads_a_lost_frame_with_and_without_a_line_end() -> None:
    for end in (b"", b"\n", b"\r\n"):
        (sample,) = EyeTribe().feed(LOST_FRAME.encode() + end)
        assert sample[2:] == (604571264, None, None, None)


def test_eyetribe_reads_raw_points_not_smoothed_ones() -> None:
    message = json.loads(LOST_FRAME)
    frame = message["values"]["frame"]
    frame |= {"state": 7, "raw": {"x": 812.5, "y": 300.0}, "avg": {"x": 1.0, "y": 2.0}}
    frame["lefteye"]["raw"] = {"x": 810.0, "y": 301.0}
    (sample,) = EyeTribe().feed(json.dumps(message).encode())
    assert (sample.left, sample.right, sample.both) == ((810, 301), None, (812.5, 300))


def test_eyetribe_sends_a_sign_of_life_twice_as_often_as_the_server_wants() -> None:
    codec = EyeTribe()
    codec.feed(b'{"category":"tracker","request":"get","statuscode":200,"values":{"heartbeatinterval":3000}}')
    assert codec.due(0) == HEARTBEAT
    assert codec.due(1_499_999_999) == b""
    assert codec.due(1_500_000_000) == HEARTBEAT


def test_eyetribe_ignores_other_messages() -> None:
    codec = EyeTribe()
    assert codec.feed(b'{"category":"heartbeat","statuscode":200}{"category":"tracker","values":{"push":true}}') == []
    assert codec.bad == 0


# Self-made devices


def test_csv_reads_what_self_made_devices_send_once_a_line_has_ended() -> None:
    assert [s.both for s in CsvLines().feed(b"22, 431)\n(1522, 431)\n")] == [(1522, 431)]
    codec = CsvLines(("t", "xl", "yl", "xr", "yr", "v", "-"))
    samples = feed_lines(codec, "", "17; 1.5; 2; 3; 4; 1; boot", "18 5 6 nan nan 1 x", "19,5,6,7,8,0,")
    assert [(s.ticks, s.left, s.right) for s in samples] == [
        (17, (1.5, 2), (3, 4)),
        (18, (5, 6), None),
        (19, None, None),
    ]


@pytest.mark.parametrize("line", ["1,2,3", "1", "1,2x", "1_0,2", "infinity,3", "Arduino ready", "1,,2"])
def test_csv_refuses_lines_of_another_shape(line: str) -> None:
    codec = CsvLines()
    assert feed_lines(codec, "", line) == []
    assert codec.bad == 1


@pytest.mark.parametrize("fields", [("x",), ("x", "y", "z"), ("x", "x", "y"), ("xl", "yl")])
def test_csv_refuses_other_fields(fields: tuple[str, ...]) -> None:
    with pytest.raises(ConfigError, match="fields"):
        CsvLines(fields)


def test_jsonl_reads_values_at_paths() -> None:
    codec = JsonLines({"x": "gaze.0", "y": "gaze.1", "t": "time.ms", "v": "ok"})
    line = '{"gaze": [0.25, 0.5], "time": {"ms": 12.5}, "ok": true}'
    lost = '{"gaze": [null, NaN], "time": {"ms": 14}, "ok": true}'
    samples = feed_lines(
        codec, line, lost, line.replace("true", "false"), '{"gaze": [1]}', '{"x": 3', "[]", '{"gaze": 1}'
    )
    assert [(s.ticks, s.both) for s in samples] == [(12.5, (0.25, 0.5)), (14, None), (12.5, None)]
    assert codec.bad == 4


def test_jsonl_needs_no_time_and_no_validity() -> None:
    (sample,) = feed_lines(JsonLines(), '{"x": 3, "y": 4}')
    assert (sample.ticks, sample.both) == (None, (3, 4))


def test_regex_reads_its_groups() -> None:
    codec = PatternLines(r"#(?P<t>\d+) at (?P<x>[-\d.]+)/(?P<y>[-\d.]+)(?: (?P<v>[01]))?")
    samples = feed_lines(codec, "", "#12 at 3.5/-4", "#13 at 3.5/-4 0", "#14 at 3.5/-4 and more", "#15 at ../4")
    assert [(s.ticks, s.both) for s in samples] == [(12, (3.5, -4)), (13, None)]
    assert codec.bad == 2


@pytest.mark.parametrize("pattern", ["(?P<x>.)", "(?P<x>.)(?P<y>.)(?P<z>.)", "(?P<x>"])
def test_regex_refuses_other_patterns(pattern: str) -> None:
    with pytest.raises(ConfigError, match="pattern"):
        PatternLines(pattern)


@pytest.mark.parametrize("x", [math.nan, math.inf, -32768.0])
def test_codes_are_never_a_gaze(x: float) -> None:
    assert seen(x, 5.0) is None
    assert seen(5.0, x) is None
    assert seen(0.0, 0.0) is None
    assert seen(0.0, 5.0) == (0, 5)

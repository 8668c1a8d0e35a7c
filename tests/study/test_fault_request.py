"""What a command asks of a data set: defaults of its options."""

from femgear.study.fault_request import FaultRequest, FurtherRecords


def test_a_request_has_all_kinds_and_a_set_of_a_thousand_records():
    request = FaultRequest()
    assert request.kinds == request.gears == request.sizes == ()
    assert request.count % request.each == 0
    assert FurtherRecords().index is None

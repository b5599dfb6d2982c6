"""A refusal of the C library as an exception."""

from bslam.errors import BslamError


class CoreError(BslamError):
    """The C library refused an input; the estimate is unchanged.

    `status` is the name of the C status, "BSLAM_E_TIME" say.
    """

    def __init__(self, status: str, message: str) -> None:
        super().__init__(f"{message} ({status})")
        self.status = status

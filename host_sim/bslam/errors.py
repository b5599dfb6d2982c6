"""The one exception a user sees."""


class BslamError(Exception):
    """Bad input. The message says what is wrong, where (file, line or key), and what is allowed.

    The command line prints the message as the last line on stderr and exits with status 2.
    """

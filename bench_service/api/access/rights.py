"""The right that each route needs: every route that changes something is named here, reading needs the right to see.

`docs/rights.md` is made from this. A route that changes something and is not named here is an admin's alone.
"""

from bench_service.access.roles import Right

READING = ("GET", "HEAD")
RIGHTS: dict[str, Right] = {
    # health, the log-in, and what its page is made of
    "healthz": Right.OPEN,
    "readyz": Right.OPEN,
    "read_static": Right.OPEN,
    "read_static_of_release": Right.OPEN,
    "words": Right.OPEN,
    "choose_language": Right.OPEN,
    "log_in_page": Right.OPEN,
    "read_session": Right.OPEN,
    "log_in": Right.OPEN,
    "log_out": Right.SEE,
    # previews, prints and checks change nothing
    "print_certificate": Right.SEE,
    "check_certificate_file": Right.SEE,
    "preview": Right.SEE,
    "preview_batch": Right.SEE,
    "preview_campaign": Right.SEE,
    "stop": Right.STOP,
    "stop_by_form": Right.STOP,
    "submit": Right.OPERATE,
    "change_job": Right.OPERATE,
    "cancel": Right.OPERATE,
    "pause": Right.OPERATE,
    "answer": Right.OPERATE,
    "add_note": Right.OPERATE,
    "add_unit_note": Right.OPERATE,
    "resume": Right.OPERATE,
    "release": Right.OPERATE,
    "release_stop": Right.OPERATE,
    "reserve": Right.OPERATE,
    "enter_mounting": Right.OPERATE,
    "end_mounting": Right.OPERATE,
    "begin_manual": Right.OPERATE,
    "renew_manual": Right.OPERATE,
    "end_manual": Right.OPERATE,
    "demand_by_hand": Right.OPERATE,
    "end_reservation": Right.OPERATE,
    "cancel_campaign_run": Right.OPERATE,
    "recompute": Right.OPERATE,
    "analyse_again": Right.ENGINEER,
    "run_method": Right.ENGINEER,
    "cancel_batch": Right.ENGINEER,
    "retry_batch": Right.ENGINEER,
    "import_recording": Right.ENGINEER,
    "synthesise_recording": Right.ENGINEER,
    "describe_file": Right.ENGINEER,
    "declare_unit": Right.ENGINEER,
    "choose_correction": Right.ENGINEER,
    "choose_correction_by_rule": Right.ENGINEER,
    "approve_correction": Right.ENGINEER,
    "reject_correction": Right.ENGINEER,
    "enter_calibration": Right.ENGINEER,
    "choose_calibration": Right.ENGINEER,
    "choose_by_rule": Right.ENGINEER,
    "approve_calibration": Right.ENGINEER,
    "reject_calibration": Right.ENGINEER,
    "add_campaign": Right.ENGINEER,
    "replace_campaign": Right.ENGINEER,
    "start_campaign": Right.ENGINEER,
    "add_schedule": Right.ENGINEER,
    "change_schedule": Right.ENGINEER,
    "remove_schedule": Right.ENGINEER,
    "approve_procedure": Right.ENGINEER,
    "withdraw_approval": Right.ENGINEER,
    "restore_raw_data": Right.ENGINEER,
    "hold_raw_data": Right.ENGINEER,
    "release_hold": Right.ADMIN,
    "remove_raw_data": Right.ADMIN,
    "archive_raw_data": Right.ADMIN,
    "verify_audit": Right.ADMIN,
    "close_audit": Right.ADMIN,
    "list_accounts": Right.ACCESS,
    "add_account": Right.ACCESS,
    "change_account": Right.ACCESS,
    "remove_account": Right.ACCESS,
    "list_tokens": Right.ACCESS,
    "add_token": Right.ACCESS,
    "revoke_token": Right.ACCESS,
}
"""Rights by the name of the route, which is the operation's in the API's document."""


def right_of(name: str, method: str) -> Right:
    """Return the right that a route needs, by its name; one that is not listed needs `SEE` for reading, `ADMIN` for
    anything else.
    """
    return RIGHTS.get(name, Right.SEE if method in READING else Right.ADMIN)

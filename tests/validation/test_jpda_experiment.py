"""Paper 3's simulated experiment: both forms follow all; with misses the printed one loses more."""

from tests.validation.jpda_experiment import FORMS, Setting, run, summary

SEEDS = range(6)


def test_papers_setting_is_followed_by_both_forms():
    setting = Setting()
    runs = [run(setting, seed) for seed in SEEDS]
    for form in FORMS:
        found = summary(setting, runs, form)
        assert found["steps lost"] == 0.0
        assert found["rms error"] < setting.noise


def test_printed_form_loses_where_targets_are_missed():
    setting = Setting(detection=0.7, false=80.0)
    runs = [run(setting, seed) for seed in SEEDS]
    ours, printed = (summary(setting, runs, form) for form in FORMS)
    assert ours["steps lost"] < 0.5 * printed["steps lost"]
    assert ours["median error"] < printed["median error"]

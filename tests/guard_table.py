"""The table of guards: what protects, how the code reads without it, and the tests that miss it.

See `guards`, which replays it.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple


class Guard(NamedTuple):
    """A protection: its file, its text there, the text without it, and tests that miss it."""

    name: str
    file: str  # below contactlib/, or of fmu/ or tests/
    text: str
    without: str
    tests: str  # as pytest takes them, with -k


def guards_of(file: str, module: str, *rows: tuple[str, str, str, str]) -> Iterator[Guard]:
    """Guards of one file with tests of one module: name, text, text without, what -k takes."""
    return (Guard(name, file, old, new, f"{module} -k {k!r}") for name, old, new, k in rows)


GUARDS = [
    # ---- files: the old or the new one, whole ---------------------------------------------------
    *guards_of(
        "contactlib/files.py",
        "test_faults.py",
        (
            "written beside",
            'beside = path.with_name(f".{path.name[:40]}.{secrets.token_hex(8)}")',
            "beside = path",
            "old_file or kill or whole",
        ),
        (
            "nothing left beside",
            "        beside.unlink(missing_ok=True)\n        raise",
            "        raise",
            "old_file or no_space",
        ),
        ("names of full length", "path.name[:40]", "path.name", "any_name"),
        ("a name of its own beside", "{secrets.token_hex(8)}", "new", "two_that_write"),
        (
            "data on the disk before the rename",
            "            os.fsync(file.fileno())",
            "            file.fileno()",
            "on_the_disk",
        ),
        ("name on the disk", "    _sync_folder(path.parent)", "    path.parent", "on_the_disk"),
        (
            "the file that was asked for is named",
            "raise OSError(error.errno, error.strerror, os.fspath(path)) from None",
            "raise",
            "names_it or no_space or folder_is",
        ),
        (
            "links stay",
            "Path(os.path.realpath(path)) if path.is_symlink() else path",
            "path",
            "link",
        ),
        (
            "pipes and devices stay",
            "if path.exists() and not path.is_file():",
            "if path.is_dir():",
            "pipe_takes",
        ),
        (
            "protected files stay",
            "if known and not os.access(path, os.W_OK):",
            "if not known and not os.access(path.parent, os.R_OK):",
            "without_write_permission",
        ),
        (
            "rights stay",
            "            shutil.copymode(path, beside)",
            "            shutil.get_archive_formats()",
            "old_rights",
        ),
    ),
    *guards_of(
        "contactlib/sweep/lock.py",
        "test_faults.py",
        (
            "a lock that names nobody",
            "                path.unlink(missing_ok=True)\n                if",
            "                if",
            "lock",
        ),
    ),
    *guards_of(
        "contactlib/sweep/lock.py",
        "test_sweep_execution.py",
        (
            "one start for one folder",
            "os.O_WRONLY | os.O_CREAT | os.O_EXCL",
            "os.O_WRONLY | os.O_CREAT",
            "second_start",
        ),
    ),
    *guards_of(
        "contactlib/report.py",
        "test_faults.py",
        (
            "the old comparison",
            "        if len(runs) == 1:",
            "        if len(runs) > 0:",
            "comparison",
        ),
    ),
    *guards_of(
        "contactlib/sweep/store.py",
        "test_faults.py",
        ("what kills left of a plan", '*folder.glob(".plan.json.*")', "*()", "among_the_chunks"),
    ),
    *guards_of(
        "contactlib/sweep/store.py",
        "test_sweep_execution.py",
        (
            "checksum of a chunk",
            "if data[:CHECKSUM] != self._checksum(first, contents):",
            "if not data[:CHECKSUM]:",
            "damaged_chunk",
        ),
    ),
    *guards_of(
        "contactlib/comparison.py",
        "test_faults.py",
        (
            "files are written in one place",
            'write_whole(Path(folder) / f"metrics.{suffix}", content.encode())',
            '[p := Path(folder) / f"metrics.{suffix}", p.write_bytes(content.encode())][0]',
            "other_module or metrics",
        ),
    ),
    # ---- surroundings: clocks, languages, terminals, signals, other versions --------------------
    *guards_of(
        "contactlib/export/package.py",
        "test_surroundings.py",
        (
            "zip entries have no date",
            "date_time=(1980, 1, 1, 0, 0, 0)",
            "date_time=(t := __import__('time')).localtime(t.time() % 1e9 + 5e8)[:6]",
            "do_not_know_the_time",
        ),
    ),
    *guards_of(
        "contactlib/figures/style.py",
        "test_surroundings.py",
        ("PDF has no date", '"pdf": {"CreationDate": None}', '"pdf": {}', "do_not_know_the_time"),
        ("SVG has no date", '"svg": {"Date": None}', '"svg": {}', "do_not_know_the_time"),
        (
            "endings of figures",
            "    if kind not in UNDATED:",
            "    if kind is None:",
            "another_ending",
        ),
    ),
    *guards_of(
        "contactlib/cli.py",
        "test_surroundings.py",
        (
            "time left by a clock that never jumps",
            "        return time.monotonic() - self._start",
            "        return time.time() - self._start",
            "time_left",
        ),
        (
            "letters that a terminal has not",
            'stream.reconfigure(errors="backslashreplace")',
            "stream.flush()",
            "cannot_show",
        ),
        (
            "broken pipe",
            "isinstance(error, BrokenPipeError) and error.filename is None",
            "error is None",
            "reader_that_has_gone",
        ),
        (
            "SIGTERM",
            "signal.signal(signal.SIGTERM, signal.default_int_handler)",
            "signal.getsignal(signal.SIGTERM)",
            "asked_to_end",
        ),
    ),
    *guards_of(
        "fmu/component.c",
        "test_surroundings.py",
        (
            "dot in messages of the FMU",
            "    if (length == 0 || !isfinite(value)) return text;",
            "    if (length < 99) return text;",
            "decimal_comma",
        ),
    ),
    *guards_of(
        "contactlib/terminal.py",
        "test_surroundings.py",
        (
            "one line",
            '.replace("\\n", r"\\n")',
            "",
            "one_line",
        ),
    ),
    *guards_of(
        "contactlib/kernel.py",
        "test_surroundings.py",
        (
            "version of a table, in Python",
            "ffi.string(error).decode() + _versions(data)",
            "ffi.string(error).decode()",
            "table_of_another",
        ),
    ),
    *guards_of(
        "fmu/checked_file.c",
        "test_surroundings.py",
        (
            "older files",
            "if (found_version < version) return",
            "if (found_version + 9 < version) return",
            "of_another_version and older",
        ),
        (
            "newer files",
            "if (found_version > version) return",
            "if (found_version > version + 9) return",
            "of_another_version and newer",
        ),
    ),
    *guards_of(
        "contactlib/sweep/store.py",
        "test_surroundings.py",
        (
            "chunks of another plan",
            'if known.get("digest") != digest or',
            "if",
            "another_contactlib and chunks",
        ),
    ),
    *guards_of(
        "contactlib/sweep/ensemble.py",
        "test_surroundings.py",
        (
            "results of another plan",
            'if known.attrs.get("plan_digest") != digest:',
            'if "plan_digest" not in known.attrs:',
            "another_contactlib and nc",
        ),
    ),
    # ---- files that name files, and what may run ------------------------------------------------
    *guards_of(
        "contactlib/scenario/beside.py",
        "test_security.py",
        (
            "no way out by name",
            'if meant.anchor or ".." in meant.parts:',
            "if False:",
            "leads_out_is_refused and law",
        ),
        (
            "no way out by link",
            "if not (place / name).resolve().is_relative_to(place.resolve()):",
            "if False:",
            "a_link_that_leads_out_is_refused",
        ),
        (
            "plain files only",
            "(place / name).is_file()",
            "(place / name).exists()",
            "only_plain_files_are_opened",
        ),
    ),
    *guards_of(
        "contactlib/scenario/contact_sections.py",
        "test_security.py",
        (
            "law's file beside its model",
            'path = file_beside("file", self.file, folder, "the model")',
            "path = folder / self.file",
            "a_link_that_leads_out_is_refused",
        ),
    ),
    *guards_of(
        "contactlib/scenario/vehicle.py",
        "test_security.py",
        (
            "law's file beside the scenario that changes it",
            'folder if "file" in given.get("law", {}) else file.parent',
            "file.parent",
            "files_beside_and_below_are_read",
        ),
    ),
    *guards_of(
        "contactlib/sweep/store.py",
        "test_security.py",
        (
            "no pickles in chunks",
            "allow_pickle=False",
            "allow_pickle=True",
            "a_chunk_with_the_right_checksum_runs_nothing",
        ),
    ),
    *guards_of(
        "contactlib/checker/__init__.py",
        "test_security.py",
        (
            "FMU runs only if asked",
            "runs = load and whole",
            "runs = whole",
            "an_fmu_runs_if_that_is_asked_for_only",
        ),
        (
            "unsound zip is not unpacked",
            "runs = load and whole",
            "runs = load",
            "written_elsewhere and above",
        ),
    ),
    *guards_of(
        "fmu/build_hook.py",
        "test_security.py",
        (
            "Zig's cache is private",
            'folder = tempfile.mkdtemp(prefix="zig-cache-")',
            'folder = f"{tempfile.gettempdir()}/zig-cache"',
            "temporary_files_are_private",
        ),
    ),
    # ---- zip and XML ----------------------------------------------------------------------------
    *guards_of(
        "contactlib/checker/xml.py",
        "test_readers.py",
        (
            "XML with entities is refused",
            "if root.getroottree().docinfo.internalDTD is not None:",
            "if False:",
            "entities_are_refused and nowhere",
        ),
    ),
    *guards_of(
        "contactlib/checker/archive.py",
        "test_readers.py",
        (
            "no more is unpacked than the zip says",
            "found = file.read(entry.file_size)",
            "found = file.read()",
            "fmus_that_lie_of_their_size_are_not_unpacked",
        ),
        (
            "an entry without a name",
            'if not entry.filename.endswith("/")]',
            "if not entry.is_dir()]",
            "names_that_are_no_files",
        ),
    ),
    *guards_of(
        "contactlib/checker/archive.py",
        "test_security.py",
        (
            "relative names in a zip",
            'if name.startswith("/") or ".." in parts or "\\\\" in name or ":" in name:',
            "if parts == 0:",
            "written_elsewhere and above",
        ),
        (
            "links in a zip",
            "return stat.S_ISLNK(entry.external_attr >> 16)",
            "return False",
            "written_elsewhere and link",
        ),
        (
            "control characters in a zip",
            "if not name.isprintable():",
            "if not name.isascii():",
            "written_elsewhere and control",
        ),
        (
            "empty parts in a zip",
            'if {"", "."} & set(parts):',
            'if {"..."} & set(parts):',
            "written_elsewhere and dot",
        ),
        (
            "one name for an entry",
            "if e.filename != e.orig_filename",
            "if False",
            "no_name_ends_at_a_nul",
        ),
        (
            "size a zip unpacks to",
            "if size > MOST_UNPACKED:",
            "if False:",
            "what_a_zip_unpacks_to_is_bounded",
        ),
        (
            "a file that is a folder too",
            'ordered[next_one].startswith(f"{name}/")',
            "name is ordered",
            "written_elsewhere and folder",
        ),
        (
            "names that differ in case",
            "seen.setdefault(name.casefold(), name)",
            "seen.setdefault(name, name)",
            "written_elsewhere and case",
        ),
    ),
    *guards_of(
        "contactlib/checker/archive.py",
        "test_refusals.py",
        (
            "what cannot be unpacked",
            "except (NotImplementedError, RuntimeError) as error:",
            "except LookupError as error:",
            "unpack",
        ),
    ),
    # ---- shared libraries that are read ---------------------------------------------------------
    *guards_of(
        "contactlib/checker/elf.py",
        "test_readers.py",
        (
            "versions of ELF",
            "if known > MOST_VERSIONS:",
            "if known < 0:",
            "take_forever and versions",
        ),
    ),
    *guards_of(
        "contactlib/checker/pe.py",
        "test_readers.py",
        (
            "sections of PE",
            "if sections > MOST_SECTIONS:",
            "if sections < 0:",
            "take_forever and sections",
        ),
        ("exports of PE", "if count > MOST_EXPORTS:", "if count < 0:", "take_forever and exports"),
        (
            "imports of PE",
            "for number in range(MOST_IMPORTS):",
            "for number in range(1 << 40):",
            "take_forever and imports",
        ),
    ),
    *guards_of(
        "contactlib/checker/mach_o.py",
        "test_readers.py",
        ("parts of Mach-O", "if count > MOST_PARTS:", "if count < 0:", "take_forever and parts"),
        (
            "commands of Mach-O",
            "if count > MOST_COMMANDS:",
            "if count < 0:",
            "take_forever and commands",
        ),
        ("exports of Mach-O, once", "if tries > 2:", "if tries < 0:", "take_forever and tables"),
        (
            "nodes of Mach-O's exports",
            "if len(seen) + len(waiting) > MOST_NODES:",
            "if len(seen) < 0:",
            "take_forever and nodes",
        ),
    ),
    # ---- text of strangers in terminals and pages -----------------------------------------------
    *guards_of(
        "contactlib/cli.py",
        "test_security.py",
        (
            "errors are harmless lines",
            "click.echo(harmless_line(text), err=True)",
            "click.echo(text, err=True)",
            "a_message_is_one_line_without_orders",
        ),
        (
            "reporter's lines are harmless",
            "self._console.print(harmless(text), markup=False)",
            "self._console.print(text, markup=False)",
            "the_reporter_shows_names_as_they_are",
        ),
        (
            "reporter's lines have no markup",
            "self._console.print(harmless(text), markup=False)",
            "self._console.print(harmless(text))",
            "the_reporter_shows_names_as_they_are",
        ),
        ("no emoji codes", "emoji=False, ", "", "the_reporter_shows_names_as_they_are"),
        (
            "titles of steps are harmless",
            "bar.add_task(harmless(title), total=None)",
            "bar.add_task(title, total=None)",
            "the_reporter_shows_names_as_they_are",
        ),
    ),
    *guards_of(
        "contactlib/export/documentation.py",
        "test_security.py",
        (
            "name is escaped in an FMU's page",
            "model_name=escape(model.name)",
            "model_name=model.name",
            "a_model_s_text_is_text_in_what_an_fmu_carries",
        ),
        (
            "source is escaped in an FMU's page",
            "source=escape(model.source)",
            "source=model.source",
            "a_model_s_text_is_text_in_what_an_fmu_carries",
        ),
    ),
    *guards_of(
        "contactlib/explorer/__init__.py",
        "test_security.py",
        (
            "model's text in the explorer page",
            '.replace("<", r"\\u003c")',
            "",
            "a_model_s_text_ends_no_element_of_the_page",
        ),
    ),
    # ---- model and sweep files ------------------------------------------------------------------
    *guards_of(
        "contactlib/explorer/__init__.py",
        "test_refusals.py",
        (
            "one place for a model in the page",
            "if page.count(empty) != 1:",
            "if page.count(empty) > 1:",
            "without_a_place",
        ),
    ),
    *guards_of(
        "contactlib/scenario/reading.py",
        "test_refusals.py",
        (
            "an integer in a file that floats do not hold",
            "except OverflowError:",
            "except LookupError:",
            "scenario_files",
        ),
        (
            "numbers in a file too far apart",
            "except ArithmeticError:",
            "except LookupError:",
            "no_formula",
        ),
    ),
    *guards_of(
        "contactlib/sweep/store.py",
        "test_refusals.py",
        (
            "a damaged plan",
            "    except ValueError:\n        return {}",
            "    except LookupError:\n        return {}",
            "damaged_plan",
        ),
    ),
    *guards_of(
        "contactlib/sweep/sampling.py",
        "test_refusals.py",
        ("points of a grid", "if runs > MOST_RUNS:", "if runs > 10 * MOST_RUNS:", "grid_has"),
    ),
    *guards_of(
        "contactlib/export/documentation.py",
        "test_refusals.py",
        (
            "an FMU's licence",
            'raise FileNotFoundError("contactlib is installed without its LICENSE")',
            'return b""',
            "licence",
        ),
    ),
    # ---- numbers --------------------------------------------------------------------------------
    *guards_of(
        "contactlib/parameters.py",
        "test_hostile_input.py",
        (
            "ragged rows are refused by name",
            "    except ValueError:  # rows of unequal lengths\n        numbers = False\n",
            "    except KeyError:  # rows of unequal lengths\n        numbers = False\n",
            "refused and CarterGriffith.traction_ratio",
        ),
        (
            "a message is one line",
            '    text = " ".join(repr(value).split())\n',
            "    text = repr(value)\n",
            "refused and CarterGriffith-k_hat",
        ),
        (
            "a wider type's number is refused without a warning",
            '    with np.errstate(over="ignore"):  # a wider type\'s number may be infinite here\n',
            "    with np.errstate():  # a wider type's number may be infinite here\n",
            "extreme and ForceElement.force",
        ),
        (
            "a long integer is refused",
            "            except OverflowError:  # of a long integer\n",
            "            except KeyError:  # of a long integer\n",
            "refused and Material-youngs",
        ),
        (
            "one number is not a list",
            "    if number.ndim:\n",
            "    if False:\n",
            "extreme and LineContact.from_semi_width",
        ),
        (
            "shapes that do not broadcast are named",
            "    except ValueError:\n        shapes = ",
            "    except KeyError:\n        shapes = ",
            "extreme and at_creepage",
        ),
        (
            "numbers too far apart are refused",
            "    if not limits.allow(value):\n        causes",
            "    if False:\n        causes",
            "extreme and LineContact",
        ),
        (
            "a division by zero is refused",
            "    except (ArithmeticError, ValueError):  # such as a division by zero\n",
            "    except KeyError:  # such as a division by zero\n",
            "extreme and LineContact.from_semi_width",
        ),
    ),
    *guards_of(
        "contactlib/laws/line.py",
        "test_hostile_input.py",
        (
            "the law at the smallest k_hat",
            "SMALLEST_K_HAT = 1e-60 ",
            "SMALLEST_K_HAT = 0.0 ",
            "good_call and smallest",
        ),
    ),
    *guards_of(
        "contactlib/laws/polach.py",
        "test_hostile_input.py",
        ("Polach's law far away", "FAR = 1e150 ", "FAR = math.inf ", "extreme and Polach"),
        (
            "Polach's peak of extreme reductions",
            "math.sqrt(v) / adhesion if adhesion > 0.0 else math.inf",
            "math.sqrt(v) / adhesion",
            "extreme and rising",
        ),
    ),
    *guards_of(
        "contactlib/profile.py",
        "test_hostile_input.py",
        (
            "a profile refuses what is no number",
            'np.interp(checked("at", at, FINITE, copy=False), ',
            "np.interp(np.asarray(at, dtype=np.float64), ",
            "refused and Profile.__call__",
        ),
        (
            "a constant profile takes no text",
            "cls((0.0,), (value,))",
            "cls((0.0,), (float(value),))",
            "refused and Profile.of",
        ),
    ),
    *guards_of(
        "contactlib/law_tables.py",
        "test_hostile_input.py",
        (
            "a cohesive table's ratio is one number",
            "    static_to_kinetic = checked_number(\n",
            "    _ = lambda *given: given\n    _(\n",
            "refused and cohesive_table",
        ),
    ),
    *guards_of(
        "contactlib/element.py",
        "test_hostile_input.py",
        (
            "at_creepage names the creepage",
            "Limits(at_least=-1.0 - most, at_most=most - 1.0, given=",
            "Limits(given=",
            "extreme and at_creepage",
        ),
        (
            "a scale that floats do not hold",
            "    return derived(name, lambda: getattr(scales, name), parameters, limits)\n",
            "    return float(getattr(scales, name))\n",
            "extreme and (k_hat or saturation_creepage)",
        ),
    ),
    *guards_of(
        "contactlib/laws/cohesive.py",
        "test_hostile_input.py",
        (
            "the cohesive stick boundary at rest",
            "            at = np.clip(np.abs(x).ravel(), SMALLEST_X, LARGEST_X)\n",
            "            at = np.abs(x).ravel()\n",
            "good_call and CohesiveZone.stick_boundary",
        ),
    ),
    *guards_of(
        "contactlib/friction.py",
        "test_hostile_input.py",
        (
            "friction's ratio is finite",
            '        self._check_derived("ratio")\n',
            "",
            "extreme and Friction-static",
        ),
    ),
    *guards_of(
        "contactlib/laws/contact_law.py",
        "test_identities.py",
        (
            "the law is odd",
            "        return np.copysign(ratio, x), slope\n",
            "        return ratio, slope\n",
            "certificate",
        ),
    ),
    *guards_of(
        "contactlib/laws/measured.py",
        "test_measured.py",
        (
            "whole cells of a measured curve",
            "        if number != int(number):\n",
            "        if number is None:\n",
            "bad_options",
        ),
        (
            "a measured curve's scale",
            "        if not np.isfinite(curve.c).all():\n",
            "        if curve is None:\n",
            "bad_options",
        ),
    ),
    *guards_of(
        "contactlib/hertz.py",
        "test_hertz_friction.py",
        ("an ellipse's aspect", "Limits(at_least=1e-60, at_most=1e60)", "Limits()", "bad_values"),
    ),
    # ---- files and states in C ------------------------------------------------------------------
    *guards_of(
        "fmu/checked_file.c",
        "test_table.py",
        (
            "checksum of a file",
            "if (found_crc != crc32_of(start + 16, size - 16))",
            "if (found_size > size + found_crc)",
            "every_damaged_file",
        ),
    ),
    *guards_of(
        "fmu/creep_table.c",
        "test_table.py",
        (
            "cells of a table",
            "table->cells_u < 1 || table->cells_u > 4096",
            "table->cells_u < 1",
            "every_damaged_file",
        ),
        (
            "length of a table",
            "if (size != TABLE_HEADER + count * sizeof(double))",
            "if (size < TABLE_HEADER && count > 0)",
            "every_damaged_file",
        ),
        (
            "numbers of a table",
            "if (!(fabs(table->coefficients[i]) <= LARGEST_NUMBER))",
            "if (fabs(table->coefficients[i]) > LARGEST_NUMBER)",
            "every_damaged_file",
        ),
    ),
    *guards_of(
        "fmu/component.c",
        "test_sealed_files.py",
        (
            "start values within their limits",
            "return misplaced(m, values, values) == NULL ? NULL",
            "return values != NULL ? NULL",
            "start_values",
        ),
        (
            "stage of a saved state",
            "    if (state->stage < INSTANTIATED || state->stage > TERMINATED) return 0;\n",
            "",
            "saved_state",
        ),
        (
            "variables of a saved state",
            "        if (!isfinite(model_get(&self->model->variables[i], values))) return 0;",
            "        if (model_get(&self->model->variables[i], values) > 1e308) return 0;",
            "saved_state",
        ),
        (
            "parameters of a saved state",
            "    if (misplaced(self->model, &self->start, values) != NULL) return 0;\n",
            "",
            "saved_state",
        ),
        (
            "tolerance of a saved state",
            "state->tolerance >= LEAST_TOLERANCE && state->tolerance <= MOST_TOLERANCE",
            "state->stale < 2",
            "saved_state",
        ),
    ),
    *guards_of(
        "fmu/component.c",
        "test_fmu.py",
        (
            "a saved state of another FMU",
            "        memcmp(self->token, start + CHECKED_FILE_FRAME, TOKEN_SIZE) != 0)",
            "        start == NULL)",
            "state_of_another_fmu",
        ),
    ),
    *guards_of(
        "fmu/fmi2.c",
        "test_native.py",
        (
            "memory for an instance of FMI 2",
            "    if (self == NULL) {",
            "    if (given == NULL) {",
            "memory_that_is_refused",
        ),
    ),
    *guards_of(
        "fmu/fmi3.c",
        "test_native.py",
        (
            "memory for an instance of FMI 3",
            "    if (self == NULL) {",
            "    if (token == NULL && self == NULL) {",
            "memory_that_is_refused",
        ),
    ),
]

#!/usr/bin/env python3
"""Writes the layer's dispatch from the Khronos registry and the policy in calls.txt.

usage: generate_dispatch.py GL_XML CALLS_TXT OUT_HPP OUT_CPP

Every command of OpenGL ES 2.0 to 3.2 and of every extension for ES gets a slot in the table of the driver's functions,
and, unless its policy is `pass`, a wrapper. calls.txt explains the policies. A policy for a name that the registry does
not have, or for one name twice, is an error: a typing mistake there would silently change what a call does.
"""
import re
import sys
import xml.etree.ElementTree as xml


def fail(text):
    sys.exit("generate_dispatch.py: " + text)


class Command:
    def __init__(self, element):
        proto = element.find("proto")
        self.name = proto.find("name").text
        self.result = "".join(proto.itertext())[: -len(self.name)].strip()
        self.params = []  # (declaration, name, type)
        for p in element.findall("param"):
            name = p.find("name").text
            text = " ".join("".join(p.itertext()).split())
            kind = text[: text.rindex(name)].strip()
            self.params.append((kind + " " + name, name, kind))
        alias = element.find("alias")
        self.alias = alias.get("name") if alias is not None else None

    short = property(lambda self: self.name[2:])
    declaration = property(lambda self: ", ".join(p[0] for p in self.params))
    arguments = property(lambda self: ", ".join(p[1] for p in self.params))


def commands_for_es(root):
    wanted = set()
    for feature in root.findall("feature"):
        if feature.get("api") == "gles2":
            wanted.update(c.get("name") for c in feature.findall("require/command"))
    for extension in root.find("extensions"):
        if "gles2" in extension.get("supported", "").split("|"):
            for require in extension.findall("require"):
                if require.get("api") in (None, "gles2"):
                    wanted.update(c.get("name") for c in require.findall("command"))
    every = {}
    for element in root.find("commands"):
        command = Command(element)
        every[command.name] = command
    return {name: every[name] for name in sorted(wanted)}


def read_policies(path):
    exact, prefixes = {}, []
    for number, line in enumerate(open(path, encoding="utf-8"), 1):
        line = line.split("#")[0].strip()
        if not line:
            continue
        policy, *names = line.split()
        group = ""
        if ":" in policy:
            policy, group = policy.split(":")
        for name in names:
            if name in exact:
                fail(f"{path}:{number}: {name} has a policy already")
            if name.endswith("*"):
                prefixes.append((name[:-1], policy, group))
            else:
                exact[name] = (policy, group)
    return exact, prefixes


def policy_of(name, exact, prefixes):
    if name in exact:
        return exact[name]
    for prefix, policy, group in prefixes:
        if name.startswith(prefix):
            return policy, group
    return "submit", ""


def vector_length(name):
    """How many values the last parameter of a uniform or vertex attribute vector call points at, as C++."""
    m = re.search(r"Matrix(\d)(?:x(\d))?fv", name)
    if m:
        return f"count * {int(m[1]) * int(m[2] or m[1])}"
    m = re.search(r"Uniform(\d)u?[if]v", name)
    if m:
        return f"count * {m[1]}"
    m = re.search(r"VertexAttrib(\d)fv", name)
    return m[1] if m else None


def undo_arguments(command, group):
    if group not in ("uniform", "program_uniform"):
        return command.arguments
    count = "count" if command.name.endswith("v") else "1"
    m = re.search(r"Matrix(\d)(?:x(\d))?fv", command.name)
    first = "program, location" if group == "program_uniform" else "location"
    if m:
        return f"{first}, {count}, {{'f', {m[2] or m[1]}, {m[1]}}}"
    m = re.search(r"Uniform(\d)(u?[if])", command.name)
    return f"{first}, {count}, {{'{m[2][0]}', {m[1]}, 0}}"


def wrapper(command, policy, group):
    call, args = f"gl.{command.short}({command.arguments})", command.arguments
    lines = [f"{command.result} GL_APIENTRY wrap_{command.name}({command.declaration}) {{"]
    back = "" if command.result == "void" else "return "
    if policy in ("submit", "finish", "attach", "remove", "forget", "upload", "indexed"):
        if policy == "upload":
            target = f", {command.params[0][1]}" if command.params and command.params[0][1] == "target" else ", 0"
        else:
            target = ""
        lines.append(f"    if (Context* c = engaged()) c->before_{policy}(Call::{command.short}{target});")
        lines.append(f"    {back}{call};")
        if policy in ("attach", "remove"):
            lines.insert(-1, "    const AttachmentWatch watch;")
        if policy == "attach" and len(command.params) > 1 and command.params[1][1] == "attachment":
            lines.append(f"    if (Context* c = engaged()) c->forget_views({command.params[0][1]}, attachment);")
    elif policy == "state":
        # Two functions: while nothing is recorded the wrapper is a test and a jump, and lies beside the others (hot).
        lines = [f"[[gnu::noinline]] {command.result} record_{command.name}(Context* c, {command.declaration}) {{"]
        lines.append(f"    c->undo().{group}({undo_arguments(command, group)});")
        lines.append(f"    {call};")
        pointer = [p for p in command.params if "*" in p[2]]
        if pointer and group != "attrib":  # a client-side array is copied by the draw that reads it
            length = vector_length(command.name)
            if len(pointer) != 1 or length is None:
                fail(f"{command.name}: a pointer parameter that `state` cannot copy")
            name = pointer[0][1]
            if "count" in length:
                lines.append("    if (count <= 0) return;")
            lines.append(f"    {pointer[0][2]} copy = c->log().copy({name}, static_cast<std::size_t>({length}));")
            args = args.replace(name, "copy") if args.endswith(name) else fail(command.name)
        # Saving what reads a deleted buffer submits, and nothing is recorded any more.
        still = "if (c->is_recording()) " if group in ("attrib", "buffer") else ""
        lines.append(f"    {still}c->log().add([=](Replay&) {{ gl.{command.short}({args}); }});")
        lines += ["}", f"[[gnu::hot]] {command.result} GL_APIENTRY wrap_{command.name}({command.declaration}) {{"]
        lines.append(f"    if (Context* c = recording()) [[unlikely]] return record_{command.name}(c, {command.arguments});")
        lines.append(f"    return {call};")
    elif policy == "log":
        lines.append(f"    Context* c = recording();")
        lines.append(f"    {call};")
        lines.append(f"    if (c) c->log().add([=](Replay&) {{ gl.{command.short}({args}); }});")
    else:
        fail(f"unknown policy {policy} of {command.name}")
    lines.append("}")
    return "\n".join(lines)


def main():
    gl_xml, calls_txt, out_hpp, out_cpp = sys.argv[1:]
    commands = commands_for_es(xml.parse(gl_xml).getroot())
    exact, prefixes = read_policies(calls_txt)
    for name in exact:
        if name not in commands:
            fail(f"{calls_txt}: the registry has no {name} for OpenGL ES")

    custom, wrappers, rows = [], [], []
    for name, c in commands.items():
        base = c
        if c.alias in commands and name not in exact and len(commands[c.alias].params) == len(c.params):
            base = commands[c.alias]
        policy, group = policy_of(base.name, exact, prefixes)
        if policy == "pass":
            hook = "nullptr"
        elif policy in ("custom", "engaged"):
            hook = f"reinterpret_cast<void*>(layer_{base.name})"
            if base is c:
                custom.append(f"{c.result} GL_APIENTRY layer_{c.name}({c.declaration});")
        else:
            hook = f"reinterpret_cast<void*>(wrap_{base.name})"
            if base is c:
                wrappers.append(wrapper(c, policy, group))
        core = "true" if name in CORE else "false"
        idle = "true" if policy not in ("pass", "custom") else "false"
        rows.append(f'    {{"{name}", reinterpret_cast<void**>(&gl.{base.short}), {hook}, {core}, {idle}}},')

    with open(out_hpp, "w", encoding="utf-8") as out:
        out.write("// Generated by generate_dispatch.py from the Khronos registry.\n#pragma once\n\n")
        out.write("#include <GLES3/gl32.h>\n#include <GLES2/gl2ext.h>\n\n#include <atomic>\n#include <cstdint>\n\n")
        out.write("namespace fovea::layer {\n\n// The driver's functions.\nstruct Gl {\n")
        for c in commands.values():
            out.write(f"    {c.result} (GL_APIENTRY* {c.short})({c.declaration}) = nullptr;\n")
        out.write("    // False until anything in this process concerns the layer: a foveated framebuffer or texture, a program of several\n")
        out.write("    // views, auto mode. An idle layer tests this one word; it lies beside the functions that are called next.\n")
        out.write("    // Relaxed: whoever draws with what another thread has foveated was told so by it.\n")
        out.write("    std::atomic<bool> anything_to_do{false};\n")
        out.write("};\nextern Gl gl;\n\nenum class Call : std::uint16_t {\n    none,\n")
        out.write("".join(f"    {c.short},\n" for c in commands.values()))
        out.write("    count_of_gl\n};\n\n// \"glFlush\" for Call::Flush.\n")
        out.write("[[nodiscard]] const char* gl_call_name(Call call) noexcept;\n\n")
        out.write("struct Row {\n    const char* name;\n    void** slot;     // in gl\n")
        out.write("    void* wrapper;   // nullptr: programs get the driver's function\n    bool core;       // of OpenGL ES 2.0 to 3.2\n    bool idle;       // while nothing concerns the layer the wrapper does what the driver's function does\n};\n")
        out.write("extern const Row kRows[];  // sorted by name\nextern const unsigned kRowCount;\n\n")
        out.write("// Written by hand.\n" + "\n".join(custom) + "\n\n}  // namespace fovea::layer\n")

    with open(out_cpp, "w", encoding="utf-8") as out:
        out.write('// Generated by generate_dispatch.py from the Khronos registry.\n#include "layer_gl.hpp"\n\n')
        out.write('#include "render/layer/context.hpp"\n\nnamespace fovea::layer {\n\nconstinit Gl gl;\n\nnamespace {\n\n')
        out.write("\n\n".join(wrappers) + "\n\n")
        out.write("const char* const kNames[] = {\n    \"\",\n" + "".join(f'    "{n}",\n' for n in commands) + "};\n\n}  // namespace\n\n")
        out.write("const char* gl_call_name(Call call) noexcept { return kNames[static_cast<unsigned>(call)]; }\n\n")
        out.write("const Row kRows[] = {\n" + "\n".join(rows) + "\n};\n")
        out.write(f"const unsigned kRowCount = {len(rows)};\n\n}}  // namespace fovea::layer\n")


CORE = set()


def collect_core(path):
    for feature in xml.parse(path).getroot().findall("feature"):
        if feature.get("api") == "gles2":
            CORE.update(c.get("name") for c in feature.findall("require/command"))


if __name__ == "__main__":
    if len(sys.argv) != 5:
        fail("usage: generate_dispatch.py GL_XML CALLS_TXT OUT_HPP OUT_CPP")
    collect_core(sys.argv[1])
    main()

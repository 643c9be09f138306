#!/usr/bin/env bash
# Exports the models of tests/exports.rs and has them judged by simulators that are not ours.
#   tests/judges/run.sh [PYTHON]    PYTHON: an interpreter with mujoco, pybullet, drake, yourdfpy, trimesh (as many
#                                   as there are; what is missing is said). Default: python3
set -euo pipefail
cd "$(dirname "$0")/../.."
python=${1:-python3}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
PALPATE_EXPORTS="$folder" cargo test --quiet --test exports leave_the_folders
"$python" tests/judges/judge_exports.py "$folder"/*
"$python" tests/judges/judge_sdf_usd.py "$folder"/*
"$python" tests/judges/judge_meshes.py "$folder"/*
"$python" tests/judges/judge_effects.py "$folder"

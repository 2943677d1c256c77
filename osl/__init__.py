# SPDX-License-Identifier: GPL-3.0-or-later
"""OSL templates and the module that fills them with tables; knows nothing of Blender."""

"""Effects of bodies on joints, one file each: the modules of this folder with one `EFFECT`, and those of installed packages."""

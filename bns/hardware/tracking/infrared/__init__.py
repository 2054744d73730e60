"""What the Wii remote needs: its input device, the lights of its marker, its calibration."""

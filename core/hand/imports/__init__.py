"""Hands made elsewhere: rigged glTF hands and MANO files become hands of 16 joints in our frame."""

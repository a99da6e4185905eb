//! Laws and motions against closed forms.
